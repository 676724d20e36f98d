"""The landing page of the results, and the pages behind it."""


rule report:
    """Pages that are read without Snakemake: verdicts, figures, tables, and where every file lies."""
    input:
        recording=str(STUDY.cohort.folder / "recording.yaml"),
        observations=expand(OBSERVATION, subject=SHOWN),
        verdicts=shown_of(*EXPERIMENTS)["verdicts"],
        trainings=tables_of(EXPERIMENTS, "training"),
        recoveries=tables_of(EXPERIMENTS, "recovery"),
        recovery_acquisitions=tables_of(EXPERIMENTS, "recovery_acquisition"),
        ppc_csv=rules.tables.output.ppc_csv,
        features_csv=rules.tables.output.features_csv,
        posterior_csv=rules.tables.output.posterior_csv,
        comparison_csv=rules.paper_comparison.output.comparison_csv,
        statements_csv=rules.paper_comparison.output.statements_csv,
        study_pngs=expand("<results>/figures/{name}.png", name=names_of("cohort")),
        training_pngs=expand(
            "<results>/figures/training-{experiment}.png", experiment=EXPERIMENTS
        ),
        exact_posteriors=shown_of(*SPEED_EXPERIMENTS)["posteriors"],
        calibrations=tables_of(SPEED_EXPERIMENTS, "calibration"),
        alarms=tables_of(SPEED_EXPERIMENTS, "alarms"),
        identifiabilities=tables_of(SPEED_EXPERIMENTS, "identifiability"),
        noise=noise_files()[:1],
        truth_csv=["<results>/tables/truth.csv" for _ in truth_files()],
        exact_pngs=expand(
            "<results>/figures/{name}-{experiment}.png",
            name=names_of("speeds"),
            experiment=SPEED_EXPERIMENTS,
        )
        + (["<results>/figures/noise.png"] if SPEED_EXPERIMENTS else []),
        population_cohorts=tables_of(POPULATIONS, "cohort"),
        population_strata=tables_of(POPULATIONS, "strata"),
        population_pngs=[
            path for name in POPULATIONS for path in figures_of(name, ["png"])
        ],
        pressures_csv=pressures_tables(),
        cohort_posteriors=expand(
            "<results>/{experiment}/cohort_posterior.h5",
            experiment=exact_experiments(),
        ),
        validation=[
            path for path in [CONFIG.validation_table] if path and Path(path).is_file()
        ],
        artefacts=linked_artefacts(),
    output:
        report=PAGES[0],
        pages=PAGES[1:],
        configuration=reported(
            "<results>/configuration.yaml",
            "configuration",
            "every choice of this run",
            category="Configuration",
        ),
    log:
        "<results>/logs/report.log",
    params:
        **stage("swesbi.report.page.study:pages_of_study"),
    script:
        "../scripts/stage.py"
