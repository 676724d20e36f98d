"""Pool -> neural posterior estimation -> prior support and posterior of each subject."""


rule pool:
    """Features of every simulation, noise augmentation, pooled standardisation."""
    input:
        observations=of_experiment(OBSERVATION),
        passives=of_experiment(PASSIVE),
        shards=lambda by: shards_of(by.experiment, STUDY.subjects_of(by.experiment)),
    output:
        pool="<results>/{experiment}/pool.h5",
    log:
        "<results>/logs/pool/{experiment}.log",
    wildcard_constraints:
        experiment=FEATURES,
    priority: 100
    params:
        **stage("swesbi.networks.paper.pool:pool_of_features"),
    script:
        "../scripts/stage.py"


rule train:
    """The network of an experiment on features, in minutes; its log says how long it will still take."""
    input:
        pool=rules.pool.output.pool,
    output:
        estimator="<results>/{experiment}/estimator.h5",
        training="<results>/{experiment}/training.csv",
        checkpoints="<results>/{experiment}/checkpoints.h5",
    log:
        "<results>/logs/train/{experiment}.log",
    wildcard_constraints:
        experiment=FEATURES,
    # long, and the rest of the experiment waits for it: it starts as soon as it can, as do those that it needs
    priority: 100
    params:
        **stage("swesbi.networks.paper.training:trained_network"),
    script:
        "../scripts/stage.py"


rule posterior:
    """Candidates of the network judged by prior support; those within the prior are the posterior."""
    input:
        pool=of_its_subject("<results>/{experiment}/pool.h5"),
        estimator=rules.train.output.estimator,
    output:
        posterior=POSTERIOR,
        verdict=reported(VERDICT, "prior_support", "verdict on prior support"),
    log:
        "<results>/logs/posterior/{experiment}/{subject}.log",
    wildcard_constraints:
        experiment=FEATURES,
    params:
        **stage("swesbi.verdict.prior_support:judged_posterior"),
    script:
        "../scripts/stage.py"


rule recovery:
    """Fresh theta from the prior, under the experiment's own observation model: what do intervals cover?"""
    input:
        pool=rules.pool.output.pool,
        estimator=rules.train.output.estimator,
        observations=of_experiment(OBSERVATION),
        passives=of_experiment(PASSIVE),
    output:
        recovery=reported("<results>/{experiment}/recovery.csv", "recovery", "recovery, own noise"),
    log:
        "<results>/logs/recovery/{experiment}.log",
    wildcard_constraints:
        experiment=FEATURES,
    params:
        **stage("swesbi.checks.recovery:own_recovery"),
    script:
        "../scripts/stage.py"


rule recovery_acquisition:
    """The same theta, but recorded with acquisition noise and passed through the whole pipeline."""
    input:
        pool=rules.pool.output.pool,
        estimator=rules.train.output.estimator,
        observations=of_experiment(OBSERVATION),
        passives=of_experiment(PASSIVE),
    output:
        recovery_acquisition=reported(
            "<results>/{experiment}/recovery_acquisition.csv",
            "recovery_acquisition",
            "recovery, acquisition noise",
        ),
    log:
        "<results>/logs/recovery_acquisition/{experiment}.log",
    wildcard_constraints:
        experiment=FEATURES,
    params:
        **stage("swesbi.checks.recovery:acquisition_recovery"),
    script:
        "../scripts/stage.py"
