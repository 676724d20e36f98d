"""Readings of the paper's text on the simulations of a finished study; not part of the study."""

READINGS = CONFIG.readings.experiment
READINGS_STUDY = {
    "pool": f"{RESULTS}/{READINGS}/pool.h5",
    "checkpoints": f"{RESULTS}/{READINGS}/checkpoints.pt",
    "shards": shards_of(READINGS, STUDY.subjects_of(READINGS)),
}
READINGS_RECORDED = {
    "observations": paths_of("cohort/{subject}/observation.h5", READINGS),
    "passives": paths_of("cohort/{subject}/passive.h5", READINGS),
}


rule readings_run:
    input:
        **READINGS_STUDY,
        **READINGS_RECORDED,
    output:
        numbers=f"{RESULTS}/readings/numbers/{{reading}}.csv",
    log:
        f"{RESULTS}/logs/readings_run/{{reading}}.log",
    wildcard_constraints:
        reading="|".join(CONFIG.readings.readings),
    params:
        stage=stage("readings_run"),
    message:
        "The paper's chain under the reading '{wildcards.reading}' (minutes; progress below)"
    script:
        "../scripts/stage.py"


rule readings_seeds:
    """Every volunteer recorded under every acquisition seed, judged under one reading."""
    input:
        **READINGS_STUDY,
        **READINGS_RECORDED,
    output:
        recordings=f"{RESULTS}/readings/seeds/{{reading}}.csv",
    log:
        f"{RESULTS}/logs/readings_seeds/{{reading}}.log",
    wildcard_constraints:
        reading="|".join(CONFIG.readings.readings),
    params:
        stage=stage("readings_seeds"),
    message:
        "Acquisition seeds under the reading '{wildcards.reading}' (minutes; progress below)"
    script:
        "../scripts/stage.py"


rule readings_cmaes:
    """Best fits by CMA-ES under other weights of its loss."""
    input:
        **READINGS_RECORDED,
    output:
        fits=f"{RESULTS}/readings/cmaes/{{reading}}.csv",
    log:
        f"{RESULTS}/logs/readings_cmaes/{{reading}}.log",
    wildcard_constraints:
        reading="|".join(CONFIG.readings.readings),
    params:
        stage=stage("readings_cmaes"),
    message:
        "CMA-ES under other weights, on recordings of the reading '{wildcards.reading}'"
    script:
        "../scripts/stage.py"


rule readings:
    input:
        numbers=expand(
            rules.readings_run.output.numbers, reading=CONFIG.readings.readings
        ),
        seeds=expand(
            rules.readings_seeds.output.recordings,
            reading=CONFIG.readings.acquisition_seeds,
        ),
        fits=expand(
            rules.readings_cmaes.output.fits, reading=CONFIG.readings.cmaes.readings
        ),
    output:
        table=f"{RESULTS}/tables/readings.csv",
        given=f"{RESULTS}/tables/readings_given.csv",
        recovery=f"{RESULTS}/tables/readings_recovery.csv",
        verdicts=f"{RESULTS}/tables/readings_verdicts.csv",
        weights=f"{RESULTS}/tables/readings_weights.csv",
        figure_pdf=f"{RESULTS}/figures/readings.pdf",
        figure_png=f"{RESULTS}/figures/readings.png",
    log:
        f"{RESULTS}/logs/readings.log",
    params:
        stage=stage("readings"),
    message:
        "Tables and figure of the readings of the paper's text"
    script:
        "../scripts/stage.py"
