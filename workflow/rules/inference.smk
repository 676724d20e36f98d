"""Pool -> neural posterior estimation -> prior support and posterior of each subject."""


rule pool:
    """Features of every simulation, noise augmentation, pooled standardisation."""
    input:
        observations=of_experiment("cohort/{subject}/observation.h5"),
        passives=of_experiment("cohort/{subject}/passive.h5"),
        shards=shards_of_experiment,
    output:
        pool=f"{RESULTS}/{{experiment}}/pool.h5",
    log:
        f"{RESULTS}/logs/pool/{{experiment}}.log",
    wildcard_constraints:
        experiment=FEATURES,
    priority: 100
    params:
        **stage("swesbi.networks.paper.pool:pool_of_features"),
    message:
        "Pooled training set of the experiment '{wildcards.experiment}'"
    script:
        "../scripts/stage.py"


rule train:
    input:
        pool=rules.pool.output.pool,
    output:
        estimator=f"{RESULTS}/{{experiment}}/estimator.pt",
        training=f"{RESULTS}/{{experiment}}/training.csv",
        checkpoints=f"{RESULTS}/{{experiment}}/checkpoints.pt",
    log:
        f"{RESULTS}/logs/train/{{experiment}}.log",
    wildcard_constraints:
        experiment=FEATURES,
    # long, and the rest of the experiment waits for it: it starts as soon as it can, as do those that it needs
    priority: 100
    params:
        **stage("swesbi.networks.paper.training:trained_network"),
    message:
        "Training the network of the experiment '{wildcards.experiment}' (minutes; progress below)"
    script:
        "../scripts/stage.py"


rule posterior:
    input:
        pool=of_its_subject("{experiment}/pool.h5"),
        estimator=rules.train.output.estimator,
    output:
        posterior=f"{RESULTS}/{{experiment}}/subjects/{{subject}}/posterior.h5",
        verdict=report(
            f"{RESULTS}/{{experiment}}/subjects/{{subject}}/verdict.json",
            caption="../report/prior_support.rst",
            category="Experiment {experiment}",
            subcategory="Subject {subject}",
            labels={"result": "verdict on prior support"},
        ),
    log:
        f"{RESULTS}/logs/posterior/{{experiment}}/{{subject}}.log",
    wildcard_constraints:
        experiment=FEATURES,
    params:
        **stage("swesbi.verdict.network_posterior:judged_posterior"),
    message:
        "Prior support and posterior of {wildcards.subject} ('{wildcards.experiment}')"
    script:
        "../scripts/stage.py"


rule recovery:
    """Fresh theta from the prior, under the experiment's own observation model: what do intervals cover?"""
    input:
        pool=rules.pool.output.pool,
        estimator=rules.train.output.estimator,
        observations=of_experiment("cohort/{subject}/observation.h5"),
        passives=of_experiment("cohort/{subject}/passive.h5"),
    output:
        recovery=report(
            f"{RESULTS}/{{experiment}}/recovery.csv",
            caption="../report/recovery.rst",
            category="Experiment {experiment}",
            subcategory="Whole cohort",
            labels={"result": "recovery, own noise"},
        ),
    log:
        f"{RESULTS}/logs/recovery/{{experiment}}.log",
    wildcard_constraints:
        experiment=FEATURES,
    params:
        **stage("swesbi.checks.synthetic_recovery:own_recovery"),
    message:
        "Synthetic recovery of the experiment '{wildcards.experiment}'"
    script:
        "../scripts/stage.py"


rule recovery_acquisition:
    """The same theta, but recorded with acquisition noise and passed through the whole pipeline."""
    input:
        pool=rules.pool.output.pool,
        estimator=rules.train.output.estimator,
        observations=of_experiment("cohort/{subject}/observation.h5"),
        passives=of_experiment("cohort/{subject}/passive.h5"),
    output:
        recovery_acquisition=report(
            f"{RESULTS}/{{experiment}}/recovery_acquisition.csv",
            caption="../report/recovery_acquisition.rst",
            category="Experiment {experiment}",
            subcategory="Whole cohort",
            labels={"result": "recovery, acquisition noise"},
        ),
    log:
        f"{RESULTS}/logs/recovery_acquisition/{{experiment}}.log",
    wildcard_constraints:
        experiment=FEATURES,
    params:
        **stage("swesbi.checks.synthetic_recovery:acquisition_recovery"),
    message:
        "Recovery from synthetic recordings, the experiment '{wildcards.experiment}'"
    script:
        "../scripts/stage.py"
