"""The page on which the model is moved by hand, without a network or anything installed."""

# A loop instead of a wildcard: the page's name does not say which experiment it is of.
for experiment in SPEED_EXPERIMENTS[:1]:

    rule:
        """Parameters are moved and the beat follows: physics, draws and recordings in one file."""
        name:
            "explorer"
        input:
            observations=of_subjects(
                "cohort/{subject}/observation.h5",
                STUDY.subjects_of(experiment)[:MOST_SHOWN],
            ),
            posteriors=files_of_subjects(["posterior.h5"], [experiment])[:MOST_SHOWN],
            supports=files_of_subjects(["support.json"], [experiment])[:MOST_SHOWN],
            noise=f"{RESULTS}/cohort/noise.h5",
        output:
            page=f"{RESULTS}/explorer.html",
        log:
            f"{RESULTS}/logs/explorer.log",
        params:
            stage=stage("explorer", experiment=experiment),
        message:
            f"Page on which the model of '{experiment}' is moved by hand"
        script:
            "../scripts/stage.py"
