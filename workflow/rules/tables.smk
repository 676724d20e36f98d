"""Tables of every experiment, beside each other."""


rule tables:
    """Table 1, features and posteriors of every experiment."""
    input:
        **shown_of(*EXPERIMENTS),
    output:
        ppc_csv=reported("<results>/tables/ppc.csv", "table_ppc", "table 1: predictive scores"),
        ppc_tex="<results>/tables/ppc.tex",
        features_csv=reported("<results>/tables/features.csv", "table_features", "features"),
        posterior_csv=reported("<results>/tables/posterior.csv", "table_posterior", "posteriors"),
        posterior_tex="<results>/tables/posterior.tex",
    log:
        "<results>/logs/tables.log",
    params:
        **stage("swesbi.report.study_tables:study_tables"),
    script:
        "../scripts/stage.py"


rule truth:
    """Credible intervals of every experiment beside the truth of a generated cohort."""
    input:
        posteriors=paths_of(POSTERIOR, *EXPERIMENTS),
        verdicts=paths_of(VERDICT, *EXPERIMENTS),
        truth=str(STUDY.cohort.folder / "truth.csv"),
    output:
        truth_csv=reported("<results>/tables/truth.csv", "table_truth", "truth of a generated cohort"),
    log:
        "<results>/logs/truth.log",
    params:
        **stage("swesbi.report.study_tables:beside_the_truth"),
    script:
        "../scripts/stage.py"


rule paper_comparison:
    """Every number that the paper prints, and every statement on its results, beside this study's."""
    input:
        protocol=str(STUDY.cohort.folder / "recording.yaml"),
        ppc=rules.tables.output.ppc_csv,
        posterior=rules.tables.output.posterior_csv,
        features=rules.tables.output.features_csv,
        recoveries=files_of(FEATURE_EXPERIMENTS, "recovery.csv"),
        training=f"<results>/{MAIN}/training.csv",
        pool=f"<results>/{MAIN}/pool.h5",
        verdicts=paths_of(VERDICT, MAIN),
        observations=paths_of(OBSERVATION, MAIN),
        cmaes=paths_of(CMAES, MAIN),
    output:
        comparison_csv=reported(
            "<results>/tables/paper_comparison.csv",
            "table_comparison",
            "beside the paper",
        ),
        statements_csv=reported(
            "<results>/tables/statements.csv",
            "table_statements",
            "statements of the paper",
        ),
    log:
        "<results>/logs/paper_comparison.log",
    params:
        **stage("swesbi.report.paper.study:beside_the_paper", experiment=MAIN),
    script:
        "../scripts/stage.py"
