"""The landing page of the results, and the pages behind it."""


rule report:
    """Pages that are read without Snakemake: verdicts, figures, tables, and where every file lies."""
    input:
        recording=str(STUDY.cohort.folder / "recording.yaml"),
        observations=expand(OBSERVATION, subject=SHOWN),
        verdicts=paths_of(VERDICT, *EXPERIMENTS),
        trainings=files_of(EXPERIMENTS, "training.csv"),
        recoveries=files_of(EXPERIMENTS, "recovery.csv"),
        recovery_acquisitions=files_of(EXPERIMENTS, "recovery_acquisition.csv"),
        ppc_csv=rules.tables.output.ppc_csv,
        features_csv=rules.tables.output.features_csv,
        posterior_csv=rules.tables.output.posterior_csv,
        comparison_csv=rules.paper_comparison.output.comparison_csv,
        statements_csv=rules.paper_comparison.output.statements_csv,
        study_pngs=expand("<results>/figures/{name}.png", name=names_of("cohort")),
        training_pngs=figures_of(EXPERIMENTS, names_of("experiment"), ["png"]),
        exact_posteriors=paths_of(POSTERIOR, *SPEED_EXPERIMENTS),
        calibrations=files_of(SPEED_EXPERIMENTS, "calibration.csv"),
        alarms=files_of(SPEED_EXPERIMENTS, "alarms.csv"),
        identifiabilities=files_of(SPEED_EXPERIMENTS, "identifiability.csv"),
        noise=NOISE_FILES[:1],
        truth_csv=TRUTH_TABLES,
        exact_pngs=[
            *figures_of(SPEED_EXPERIMENTS, names_of("speeds"), ["png"]),
            *expand("<results>/figures/{name}.png", name=NOISE_FIGURES),
        ],
        population_cohorts=files_of(POPULATIONS, "cohort.csv"),
        population_strata=files_of(POPULATIONS, "strata.csv"),
        population_pngs=figures_of(POPULATIONS, OF_POPULATION, ["png"]),
        pressures_csv=PRESSURES_TABLES,
        cohort_posteriors=files_of(
            filter(STUDY.answered, [*SPEED_EXPERIMENTS, *POPULATIONS]),
            "cohort_posterior.h5",
        ),
        validation=[
            path for path in [CONFIG.validation_table] if path and Path(path).is_file()
        ],
        artefacts=linked_artefacts(),
    output:
        report=PAGES[0],
        pages=PAGES[1:],
        configuration=reported(
            "<results>/configuration.yaml", "configuration", "every choice of this run"
        ),
    log:
        "<results>/logs/report.log",
    params:
        **stage("swesbi.report.page.study:pages_of_study"),
    script:
        "../scripts/stage.py"
