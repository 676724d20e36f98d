"""Tables of every experiment, beside each other."""


rule tables:
    """Table 1, features and posteriors of every experiment."""
    input:
        unpack(of_cohort(*EXPERIMENTS)),
    output:
        ppc_csv=reported(
            f"{RESULTS}/tables/ppc.csv",
            "table_ppc",
            "table 1: predictive scores",
            category="Tables",
        ),
        ppc_tex=f"{RESULTS}/tables/ppc.tex",
        features_csv=reported(
            f"{RESULTS}/tables/features.csv",
            "table_features",
            "features",
            category="Tables",
        ),
        posterior_csv=reported(
            f"{RESULTS}/tables/posterior.csv",
            "table_posterior",
            "posteriors",
            category="Tables",
        ),
        posterior_tex=f"{RESULTS}/tables/posterior.tex",
    log:
        f"{RESULTS}/logs/tables.log",
    params:
        **stage("swesbi.report.study_tables:study_tables"),
    script:
        "../scripts/stage.py"


rule truth:
    """Credible intervals of every experiment beside the truth of a generated cohort."""
    input:
        posteriors=paths_of(
            "{experiment}/subjects/{subject}/posterior.h5", *EXPERIMENTS
        ),
        verdicts=paths_of("{experiment}/subjects/{subject}/verdict.json", *EXPERIMENTS),
        truth=str(STUDY.cohort.folder / "truth.csv"),
    output:
        truth_csv=reported(
            f"{RESULTS}/tables/truth.csv",
            "table_truth",
            "truth of a generated cohort",
            category="Tables",
        ),
    log:
        f"{RESULTS}/logs/truth.log",
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
        recoveries=expand(
            f"{RESULTS}/{{experiment}}/recovery.csv", experiment=FEATURE_EXPERIMENTS
        ),
        training=f"{RESULTS}/{MAIN}/training.csv",
        pool=f"{RESULTS}/{MAIN}/pool.h5",
        verdicts=paths_of("{experiment}/subjects/{subject}/verdict.json", MAIN),
        observations=paths_of("cohort/{subject}/observation.h5", MAIN),
        cmaes=paths_of("cmaes/{subject}.h5", MAIN),
    output:
        comparison_csv=reported(
            f"{RESULTS}/tables/paper_comparison.csv",
            "table_comparison",
            "beside the paper",
            category="Tables",
        ),
        comparison_tex=f"{RESULTS}/tables/paper_comparison.tex",
        statements_csv=reported(
            f"{RESULTS}/tables/statements.csv",
            "table_statements",
            "statements of the paper",
            category="Tables",
        ),
    log:
        f"{RESULTS}/logs/paper_comparison.log",
    params:
        **stage("swesbi.report.paper.study:beside_the_paper", experiment=MAIN),
    script:
        "../scripts/stage.py"
