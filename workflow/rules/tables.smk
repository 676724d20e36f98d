"""Tables of every experiment, beside each other."""


rule tables:
    input:
        unpack(of_cohort(*EXPERIMENTS)),
    output:
        ppc_csv=report(
            f"{RESULTS}/tables/ppc.csv",
            caption="../report/table_ppc.rst",
            category="Tables",
            labels={"result": "table 1: predictive scores"},
        ),
        ppc_tex=f"{RESULTS}/tables/ppc.tex",
        features_csv=report(
            f"{RESULTS}/tables/features.csv",
            caption="../report/table_features.rst",
            category="Tables",
            labels={"result": "features"},
        ),
        posterior_csv=report(
            f"{RESULTS}/tables/posterior.csv",
            caption="../report/table_posterior.rst",
            category="Tables",
            labels={"result": "posteriors"},
        ),
        posterior_tex=f"{RESULTS}/tables/posterior.tex",
    log:
        f"{RESULTS}/logs/tables.log",
    params:
        **stage("swesbi.report.study_tables:study_tables"),
    message:
        "Tables of every experiment: table 1, features, posteriors"
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
        truth_csv=report(
            f"{RESULTS}/tables/truth.csv",
            caption="../report/table_truth.rst",
            category="Tables",
            labels={"result": "truth of a generated cohort"},
        ),
    log:
        f"{RESULTS}/logs/truth.log",
    params:
        **stage("swesbi.report.study_tables:beside_the_truth"),
    message:
        "Table: credible intervals beside the truth"
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
        comparison_csv=report(
            f"{RESULTS}/tables/paper_comparison.csv",
            caption="../report/table_comparison.rst",
            category="Tables",
            labels={"result": "beside the paper"},
        ),
        comparison_tex=f"{RESULTS}/tables/paper_comparison.tex",
        statements_csv=report(
            f"{RESULTS}/tables/statements.csv",
            caption="../report/table_statements.rst",
            category="Tables",
            labels={"result": "statements of the paper"},
        ),
    log:
        f"{RESULTS}/logs/paper_comparison.log",
    params:
        **stage("swesbi.report.paper.study:beside_the_paper", experiment=MAIN),
    message:
        "Table: every number of the paper beside this study's"
    script:
        "../scripts/stage.py"
