"""Choice of the discrepancy on a generated cohort with known model error; not part of the study."""


rule discrepancy:
    """Evidence and coverage of each pair (delta, tau); no subject of the cohort is used."""
    output:
        table=f"{RESULTS}/tables/discrepancy.csv",
        figure_pdf=f"{RESULTS}/figures/discrepancy.pdf",
        figure_png=f"{RESULTS}/figures/discrepancy.png",
    log:
        f"{RESULTS}/logs/discrepancy.log",
    params:
        stage=stage("discrepancy", experiment=CONFIG.discrepancy_study.experiment),
    message:
        "Choice of the discrepancy on a generated cohort (minutes; progress below)"
    script:
        "../scripts/stage.py"
