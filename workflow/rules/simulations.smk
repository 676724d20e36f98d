"""Successful simulations from each prior, in shards."""


rule simulate:
    """Successful simulations of one subject from a prior."""
    output:
        shard="<results>/simulations/{prior}/{subject}/shard-{shard}.h5",
    log:
        "<results>/logs/simulate/{prior}/{subject}/shard-{shard}.log",
    priority: 80
    params:
        **stage("swesbi.heart.prior_simulations:shard_of_prior"),
    script:
        "../scripts/stage.py"
