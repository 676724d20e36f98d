"""Experiments on measured speeds: pool -> flow -> exact posterior, calibration, misspecification."""


rule speed_pool:
    """Simulations of every subject at the measured phases of its recording."""
    input:
        observations=of_subjects("cohort/{subject}/observation.h5"),
        shards=shards_of_cohort,
    output:
        pool=f"{RESULTS}/{{experiment}}/pool.h5",
    log:
        f"{RESULTS}/logs/speed_pool/{{experiment}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/speed_pool/{{experiment}}.tsv"
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        stage=stage("speed_pool"),
    message:
        "Simulations at the measured phases for the experiment '{wildcards.experiment}'"
    script:
        "../scripts/speed_pool.py"


rule train_flow:
    input:
        pool=rules.speed_pool.output.pool,
        observations=of_subjects("cohort/{subject}/observation.h5"),
        noise=f"{RESULTS}/cohort/noise.h5",
    output:
        estimator=f"{RESULTS}/{{experiment}}/estimator.pt",
        training=f"{RESULTS}/{{experiment}}/training.csv",
    log:
        f"{RESULTS}/logs/train_flow/{{experiment}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/train_flow/{{experiment}}.tsv"
    wildcard_constraints:
        experiment=SPEEDS,
    priority: 90
    params:
        stage=stage("train_flow"),
    message:
        "Training the flow of the experiment '{wildcards.experiment}' (minutes; progress below)"
    script:
        "../scripts/train_flow.py"
