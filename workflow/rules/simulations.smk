"""Successful simulations from each prior, in shards."""


rule simulate:
    output:
        shard=f"{RESULTS}/simulations/{{prior}}/{{subject}}/shard-{{shard}}.h5",
    log:
        f"{RESULTS}/logs/simulate/{{prior}}/{{subject}}/shard-{{shard}}.log",
    priority: 80
    params:
        **stage("swesbi.heart.prior_simulations:shard_of_prior"),
    message:
        "Simulations of {wildcards.subject} from the prior '{wildcards.prior}', shard {wildcards.shard}"
    script:
        "../scripts/stage.py"
