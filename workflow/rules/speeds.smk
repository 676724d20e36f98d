"""Experiments on measured speeds: pool -> flow -> exact posterior, verdict, calibration."""


rule speed_pool:
    """Simulations of every subject at the measured phases of its recording."""
    input:
        observations=of_experiment(OBSERVATION),
        shards=lambda by: shards_of(by.experiment, STUDY.subjects_of(by.experiment)),
    output:
        pool="<results>/{experiment}/pool.h5",
    log:
        "<results>/logs/speed_pool/{experiment}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    priority: 90
    params:
        **stage("swesbi.networks.flow.pool:pool_of_speeds"),
    script:
        "../scripts/stage.py"


rule train_flow:
    """The network of an experiment on speeds, in minutes; its log says how long it will still take."""
    input:
        pool=rules.speed_pool.output.pool,
        observations=of_experiment(OBSERVATION),
        noise=NOISE,
    output:
        estimator=FLOW,
        training="<results>/{experiment}/training.csv",
    log:
        "<results>/logs/train_flow/{experiment}.log",
    wildcard_constraints:
        experiment=NONE if CONFIG.networks else SPEEDS,
    priority: 90
    params:
        **stage("swesbi.networks.flow.training:trained_on_subjects"),
    script:
        "../scripts/stage.py"


rule exact_posterior:
    """The network's draws weighted with the simulator, or MCMC; how reliable they are stands beside them."""
    input:
        observation=of_its_subject(OBSERVATION),
        noise=NOISE,
        estimator=FLOW,
    output:
        posterior=POSTERIOR,
    log:
        "<results>/logs/exact_posterior/{experiment}/{subject}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.posterior.exact:posterior_of_subject"),
    script:
        "../scripts/stage.py"


rule verdict:
    """One verdict a subject, with the tests and features that say so."""
    input:
        posterior=POSTERIOR,
        null=nulls,
        observation=OBSERVATION,
        contexts="<results>/cohort/contexts.h5",
        noise=NOISE,
    output:
        verdict=reported(VERDICT, "verdict", "verdict of the misspecification tests"),
    log:
        "<results>/logs/verdict/{experiment}/{subject}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.verdict.recording:verdict_on_subject"),
    script:
        "../scripts/stage.py"


rule misspecification_figure:
    """The verdict's tests of every subject, and how often they raise an alarm."""
    input:
        table="<results>/{experiment}/alarms.csv",
        verdicts=of_experiment(VERDICT),
    output:
        figure_pdf="<results>/figures/misspecification-{experiment}.pdf",
        figure_png=drawn("misspecification_figure", "misspecification"),
    log:
        "<results>/logs/misspecification_figure/{experiment}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.report.figures.calibration:misspecification_figure"),
    script:
        "../scripts/stage.py"


rule noise_figure:
    """Noise between repeats and between samples: of each recording, and of the whole cohort."""
    input:
        noise=NOISE,
    output:
        figure_pdf="<results>/figures/noise.pdf",
        figure_png=drawn("noise_figure", "noise"),
    log:
        "<results>/logs/noise_figure.log",
    params:
        **stage("swesbi.report.figures.recording:noise_figure"),
    script:
        "../scripts/stage.py"


rule identifiability:
    """Contraction, correlations, power scaling, information of each phase, and what more repeats buy."""
    input:
        posteriors=of_experiment(POSTERIOR),
        observations=of_experiment(OBSERVATION),
        noise=NOISE,
    output:
        summary=reported(
            "<results>/{experiment}/identifiability.csv",
            "identifiability_table",
            "identifiability",
        ),
        correlations=reported(
            "<results>/{experiment}/correlations.csv",
            "correlations",
            "correlations of the posteriors",
        ),
        information=reported(
            "<results>/{experiment}/information.csv",
            "information",
            "information of the phases",
        ),
    log:
        "<results>/logs/identifiability/{experiment}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.checks.identifiability:identifiability_of_cohort"),
    script:
        "../scripts/stage.py"


rule identifiability_figures:
    """What the recordings tell."""
    input:
        posteriors=rules.identifiability.input.posteriors,
        summary=rules.identifiability.output.summary,
        information=rules.identifiability.output.information,
    output:
        identifiability_pdf="<results>/figures/identifiability-{experiment}.pdf",
        identifiability_png=drawn("identifiability_figures", "identifiability"),
    log:
        "<results>/logs/identifiability_figures/{experiment}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.report.figures.identifiability:draw_identifiability"),
    script:
        "../scripts/stage.py"


rule calibration_recordings:
    """Recordings of known parameters in one subject's context, inferred by the network and exactly."""
    input:
        observation=of_its_subject(OBSERVATION),
        noise=NOISE,
        estimator=FLOW,
    output:
        recordings="<results>/{experiment}/subjects/{subject}/calibration_recordings.h5",
    log:
        "<results>/logs/calibration_recordings/{experiment}/{subject}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.checks.calibration.known:recordings_like_subject"),
    script:
        "../scripts/stage.py"


rule calibration_local:
    """Calibration at one subject's own data, and its samplers beside long Markov chains."""
    input:
        observation=OBSERVATION,
        noise=NOISE,
        estimator=FLOW,
        posterior=rules.exact_posterior.output.posterior,
    output:
        local="<results>/{experiment}/subjects/{subject}/calibration_local.h5",
    log:
        "<results>/logs/calibration_local/{experiment}/{subject}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.checks.calibration.local:calibration_at_subject"),
    script:
        "../scripts/stage.py"


rule calibration:
    """Every check of calibration, and the coverage of known parameters."""
    input:
        recordings=of_experiment(rules.calibration_recordings.output.recordings),
        local_parts=of_experiment(rules.calibration_local.output.local),
        null=nulls,
    output:
        calibration="<results>/{experiment}/calibration.h5",
        table=reported(
            "<results>/{experiment}/calibration.csv",
            "calibration",
            "checks of calibration",
        ),
        alarms=reported("<results>/{experiment}/alarms.csv", "misspecification", "false alarms"),
        recovery=reported(
            "<results>/{experiment}/recovery.csv",
            "recovery_speeds",
            "recovery, own noise",
        ),
        recovery_acquisition=reported(
            "<results>/{experiment}/recovery_acquisition.csv",
            "recovery_speeds",
            "recovery, acquisition noise",
        ),
    log:
        "<results>/logs/calibration/{experiment}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.checks.calibration.scores:calibration_of_cohort"),
    script:
        "../scripts/stage.py"


rule calibration_figure:
    """Ranks and coverage on recordings of known parameters, and how reliable the weights were."""
    input:
        calibration=rules.calibration.output.calibration,
        table=rules.calibration.output.table,
    output:
        figure_pdf="<results>/figures/calibration-{experiment}.pdf",
        figure_png=drawn("calibration_figure", "calibration"),
    log:
        "<results>/logs/calibration_figure/{experiment}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.report.figures.calibration:draw_calibration"),
    script:
        "../scripts/stage.py"
