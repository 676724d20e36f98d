"""Predictive checks of each subject, and the CMA-ES reference fit beside them."""


rule predictive:
    """Prior and posterior predictive curves, scores, noisy features in or out of their intervals."""
    input:
        posterior=rules.posterior.output.posterior,
        verdict=rules.posterior.output.verdict,
        observation=OBSERVATION,
        passive=rules.passive.output.passive,
        shards=lambda by: shards_of(by.experiment, [by.subject]),
    output:
        predictive=PREDICTIVE,
    log:
        "<results>/logs/predictive/{experiment}/{subject}.log",
    wildcard_constraints:
        experiment=FEATURES,
    params:
        **stage("swesbi.checks.predictive_features:check_of_features"),
    script:
        "../scripts/stage.py"


rule predictive_speeds:
    """New recordings under prior and exact posterior, noise and discrepancy included."""
    input:
        posterior=POSTERIOR,
        verdict=VERDICT,
        observation=OBSERVATION,
        noise=rules.noise.output.noise,
        shards=lambda by: shards_of(by.experiment, [by.subject]),
    output:
        predictive=PREDICTIVE,
    log:
        "<results>/logs/predictive_speeds/{experiment}/{subject}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.checks.predictive_speeds:check_of_speeds"),
    script:
        "../scripts/stage.py"


rule cmaes:
    """The CMA-ES reference fit of one subject."""
    input:
        observation=OBSERVATION,
        passive=rules.passive.output.passive,
    output:
        cmaes=CMAES,
    log:
        "<results>/logs/cmaes/{subject}.log",
    params:
        **stage("swesbi.checks.cmaes:reference_fit"),
    script:
        "../scripts/stage.py"


rule epochs:
    """The same synthetic recordings and subjects under checkpoints of the training."""
    input:
        pool=rules.pool.output.pool,
        checkpoints=rules.train.output.checkpoints,
        observations=of_experiment(OBSERVATION),
        passives=of_experiment(PASSIVE),
        verdicts=of_experiment(VERDICT),
    output:
        epochs="<results>/{experiment}/epochs.csv",
    log:
        "<results>/logs/epochs/{experiment}.log",
    wildcard_constraints:
        experiment=FEATURES,
    # the longest single job behind the networks
    priority: 90
    params:
        **stage("swesbi.checks.epochs:inference_by_epoch"),
    script:
        "../scripts/stage.py"
