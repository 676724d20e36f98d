"""The landing page of the results, and the pages behind it."""


rule report:
    """Pages that are read without Snakemake: verdicts, figures, tables, and where every file lies."""
    input:
        recording=str(STUDY.cohort.folder / "recording.yaml"),
        observations=expand(OBSERVATION, subject=SHOWN),
        verdicts=paths_of(VERDICT, *EXPERIMENTS),
        exact_posteriors=paths_of(POSTERIOR, *SPEED_EXPERIMENTS),
        cohort_posteriors=files_of(
            filter(STUDY.answered, [*SPEED_EXPERIMENTS, *POPULATIONS]),
            "cohort_posterior.h5",
        ),
        noise=NOISE_FILES[:1],
        tables=[
            rules.tables.output.ppc_csv,
            rules.tables.output.features_csv,
            rules.tables.output.posterior_csv,
            *TRUTH_TABLES,
            *PRESSURES_TABLES,
        ],
        tables_of_experiments=[
            *files_of(EXPERIMENTS, "training.csv", "recovery.csv", "recovery_acquisition.csv"),
            *files_of(
                SPEED_EXPERIMENTS,
                "calibration.csv",
                "alarms.csv",
                "identifiability.csv",
            ),
        ],
        comparison_csv=rules.paper_comparison.output.comparison_csv,
        statements_csv=rules.paper_comparison.output.statements_csv,
        population_cohorts=files_of(POPULATIONS, "cohort.csv"),
        population_strata=files_of(POPULATIONS, "strata.csv"),
        pngs=[
            *expand(
                "<results>/figures/{name}.png",
                name=[*names_of("cohort"), *NOISE_FIGURES],
            ),
            *figures_of(EXPERIMENTS, names_of("experiment"), ["png"]),
            *figures_of(SPEED_EXPERIMENTS, names_of("speeds"), ["png"]),
            *figures_of(POPULATIONS, OF_POPULATION, ["png"]),
        ],
        validation=[path for path in [CONFIG.validation_table] if path and Path(path).is_file()],
        artefacts=linked_artefacts(),
    output:
        report=PAGES[0],
        pages=PAGES[1:],
        configuration=reported("<results>/configuration.yaml", "configuration", "every choice of this run"),
    log:
        "<results>/logs/report.log",
    params:
        **stage("swesbi.report.page.study:pages_of_study"),
    script:
        "../scripts/stage.py"
