"""Tables of every experiment, beside each other."""


rule tables:
    input:
        unpack(of_cohort(*EXPERIMENTS)),
    output:
        ppc_csv=f"{RESULTS}/tables/ppc.csv",
        ppc_tex=f"{RESULTS}/tables/ppc.tex",
        features_csv=f"{RESULTS}/tables/features.csv",
        posterior_csv=f"{RESULTS}/tables/posterior.csv",
    log:
        f"{RESULTS}/logs/tables.log",
    benchmark:
        f"{RESULTS}/benchmarks/tables.tsv"
    params:
        stage=stage("tables"),
    message:
        "Tables of every experiment: table 1, features, posteriors"
    script:
        "../scripts/tables.py"
