"""Predictive checks of each subject, and the CMA-ES reference fit beside them."""


rule predictive:
    """Prior and posterior predictive curves, scores, noisy features in or out of their intervals."""
    input:
        posterior=rules.posterior.output.posterior,
        support=rules.posterior.output.support,
        observation=rules.ingest.output.observation,
        passive=rules.passive.output.passive,
        shards=shards_of_subject,
    output:
        predictive=f"{RESULTS}/{{experiment}}/subjects/{{subject}}/predictive.h5",
    log:
        f"{RESULTS}/logs/predictive/{{experiment}}/{{subject}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/predictive/{{experiment}}/{{subject}}.tsv"
    params:
        stage=stage("predictive"),
    message:
        "Predictive checks of {wildcards.subject} ('{wildcards.experiment}')"
    script:
        "../scripts/predictive.py"


rule cmaes:
    input:
        observation=rules.ingest.output.observation,
        passive=rules.passive.output.passive,
    output:
        cmaes=f"{RESULTS}/cmaes/{{subject}}.h5",
    log:
        f"{RESULTS}/logs/cmaes/{{subject}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/cmaes/{{subject}}.tsv"
    params:
        stage=stage("cmaes"),
    message:
        "CMA-ES reference fit of {wildcards.subject}"
    script:
        "../scripts/cmaes.py"
