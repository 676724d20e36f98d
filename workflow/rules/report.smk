"""The landing page of the results, and the pages behind it."""


rule report:
    """Pages that are read without Snakemake: verdicts, figures, tables, and where every file lies."""
    input:
        recording=str(STUDY.cohort.folder / "recording.yaml"),
        observations=of_subjects("cohort/{subject}/observation.h5", SHOWN),
        verdicts=paths_of("{experiment}/subjects/{subject}/verdict.json", *EXPERIMENTS),
        trainings=[f"{RESULTS}/{name}/training.csv" for name in EXPERIMENTS],
        recoveries=[f"{RESULTS}/{name}/recovery.csv" for name in EXPERIMENTS],
        recovery_acquisitions=expand(
            f"{RESULTS}/{{experiment}}/recovery_acquisition.csv",
            experiment=EXPERIMENTS,
        ),
        ppc_csv=rules.tables.output.ppc_csv,
        features_csv=rules.tables.output.features_csv,
        posterior_csv=rules.tables.output.posterior_csv,
        comparison_csv=rules.paper_comparison.output.comparison_csv,
        statements_csv=rules.paper_comparison.output.statements_csv,
        study_pngs=expand(
            f"{RESULTS}/figures/{{figure}}.png", figure=names_of("cohort")
        ),
        training_pngs=expand(
            f"{RESULTS}/figures/training-{{experiment}}.png", experiment=EXPERIMENTS
        ),
        exact_posteriors=paths_of(
            "{experiment}/subjects/{subject}/posterior.h5", *SPEED_EXPERIMENTS
        ),
        calibrations=expand(
            f"{RESULTS}/{{experiment}}/calibration.csv", experiment=SPEED_EXPERIMENTS
        ),
        alarms=expand(
            f"{RESULTS}/{{experiment}}/alarms.csv", experiment=SPEED_EXPERIMENTS
        ),
        identifiabilities=expand(
            f"{RESULTS}/{{experiment}}/identifiability.csv",
            experiment=SPEED_EXPERIMENTS,
        ),
        noise=noise_files()[:1],
        truth_csv=[f"{RESULTS}/tables/truth.csv" for _ in truth_files()],
        exact_pngs=expand(
            f"{RESULTS}/figures/{{figure}}-{{experiment}}.png",
            figure=names_of("speeds"),
            experiment=SPEED_EXPERIMENTS,
        )
        + ([f"{RESULTS}/figures/noise.png"] if SPEED_EXPERIMENTS else []),
        population_cohorts=expand(
            f"{RESULTS}/{{experiment}}/cohort.csv", experiment=POPULATIONS
        ),
        population_strata=expand(
            f"{RESULTS}/{{experiment}}/strata.csv", experiment=POPULATIONS
        ),
        population_pngs=figures_of_populations("png"),
        pressures_csv=pressures_tables(),
        cohort_posteriors=expand(
            f"{RESULTS}/{{experiment}}/cohort_posterior.h5",
            experiment=with_cohort_posterior(),
        ),
        validation=validation_files(),
        artefacts=linked_artefacts(),
    output:
        report=results_pages()[0],
        pages=results_pages()[1:],
        configuration=reported(
            f"{RESULTS}/configuration.yaml",
            "configuration",
            "every choice of this run",
            category="Configuration",
        ),
    log:
        f"{RESULTS}/logs/report.log",
    params:
        **stage("swesbi.report.page.study:pages_of_study"),
    script:
        "../scripts/stage.py"
