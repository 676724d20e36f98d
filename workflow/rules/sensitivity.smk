"""What the exact posteriors owe to choices that could have been made otherwise; not part of the study."""

SENSITIVITY = CONFIG.sensitivity.experiment


rule sensitivity_run:
    input:
        observations=paths_of("cohort/{subject}/observation.h5", SENSITIVITY),
        noise=f"{RESULTS}/cohort/noise.h5",
        passives=paths_of("cohort/{subject}/passive.h5", SENSITIVITY),
    output:
        posteriors=f"{RESULTS}/sensitivity/{{variant}}.h5",
    log:
        f"{RESULTS}/logs/sensitivity_run/{{variant}}.log",
    wildcard_constraints:
        variant="|".join(CONFIG.sensitivity.variants),
    params:
        stage=stage("sensitivity_run", experiment=SENSITIVITY),
    message:
        "Posteriors under the variant '{wildcards.variant}' (minutes; progress below)"
    script:
        "../scripts/stage.py"


rule sensitivity:
    input:
        variants=expand(
            rules.sensitivity_run.output.posteriors,
            variant=CONFIG.sensitivity.variants,
        ),
    output:
        table=f"{RESULTS}/tables/sensitivity.csv",
        figure_pdf=f"{RESULTS}/figures/sensitivity.pdf",
        figure_png=f"{RESULTS}/figures/sensitivity.png",
    log:
        f"{RESULTS}/logs/sensitivity.log",
    params:
        stage=stage("sensitivity", experiment=SENSITIVITY),
    message:
        "Table and figure of what each variant changes"
    script:
        "../scripts/stage.py"
