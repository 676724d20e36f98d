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
        predictive="<results>/{experiment}/subjects/{subject}/predictive.h5",
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
        posterior="<results>/{experiment}/subjects/{subject}/posterior.h5",
        verdict="<results>/{experiment}/subjects/{subject}/verdict.json",
        observation=OBSERVATION,
        noise=rules.noise.output.noise,
        shards=lambda by: shards_of(by.experiment, [by.subject]),
    output:
        predictive="<results>/{experiment}/subjects/{subject}/predictive.h5",
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
        cmaes="<results>/cmaes/{subject}.h5",
    log:
        "<results>/logs/cmaes/{subject}.log",
    params:
        **stage("swesbi.checks.reference_fit:reference_fit"),
    script:
        "../scripts/stage.py"


rule epochs:
    """The same synthetic recordings and subjects under checkpoints of the training."""
    input:
        pool=rules.pool.output.pool,
        checkpoints=rules.train.output.checkpoints,
        observations=of_experiment("<results>/cohort/{subject}/observation.h5"),
        passives=of_experiment("<results>/cohort/{subject}/passive.h5"),
        verdicts=of_experiment("<results>/{experiment}/subjects/{subject}/verdict.json"),
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
