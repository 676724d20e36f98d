"""The page on which the model is moved by hand, without a network or anything installed."""

sys.path.insert(0, str(PROJECT))

# The page is of the first experiment on speeds, if there is one; its name does not say of which.
if SPEED_EXPERIMENTS:
    EXPLORED = SPEED_EXPERIMENTS[0]

    rule explorer:
        """Parameters are moved and the beat follows: physics, draws and recordings in one file."""
        input:
            observations=of_subjects(
                "cohort/{subject}/observation.h5",
                STUDY.subjects_of(EXPLORED)[:MOST_SHOWN],
            ),
            posteriors=files_of_subjects(["posterior.h5"], [EXPLORED])[:MOST_SHOWN],
            verdicts=files_of_subjects(["verdict.json"], [EXPLORED])[:MOST_SHOWN],
            noise=f"{RESULTS}/cohort/noise.h5",
        output:
            page=f"{RESULTS}/explorer.html",
        log:
            f"{RESULTS}/logs/explorer.log",
        params:
            **stage("explorer.stages:explorer", experiment=EXPLORED),
        script:
            "../workflow/scripts/stage.py"
