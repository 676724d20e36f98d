"""The page on which the model is moved by hand, without a network or anything installed."""

sys.path.insert(0, str(PROJECT))

# The page is of the first experiment on speeds, if there is one; its name does not say of which.
if SPEED_EXPERIMENTS:
    EXPLORED = SPEED_EXPERIMENTS[0]
    MOVED = STUDY.subjects_of(EXPLORED)[:MOST_SHOWN]
    ANSWERS = f"<results>/{EXPLORED}/subjects/{{subject}}"

    rule explorer:
        """Parameters are moved and the beat follows: physics, draws and recordings in one file."""
        input:
            observations=expand(OBSERVATION, subject=MOVED),
            posteriors=expand(f"{ANSWERS}/posterior.h5", subject=MOVED),
            verdicts=expand(f"{ANSWERS}/verdict.json", subject=MOVED),
            noise="<results>/cohort/noise.h5",
        output:
            page="<results>/explorer.html",
        log:
            "<results>/logs/explorer.log",
        params:
            **stage("explorer.stages:explorer", experiment=EXPLORED),
        script:
            "../workflow/scripts/stage.py"
