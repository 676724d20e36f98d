"""Experiments on measured speeds: pool -> flow -> exact posterior, verdict, calibration."""


rule speed_pool:
    """Simulations of every subject at the measured phases of its recording."""
    input:
        observations=of_experiment("cohort/{subject}/observation.h5"),
        shards=shards_of_experiment,
    output:
        pool=f"{RESULTS}/{{experiment}}/pool.h5",
    log:
        f"{RESULTS}/logs/speed_pool/{{experiment}}.log",
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
        observations=of_experiment("cohort/{subject}/observation.h5"),
        noise=f"{RESULTS}/cohort/noise.h5",
    output:
        estimator=FLOW,
        training=f"{RESULTS}/{{experiment}}/training.csv",
    log:
        f"{RESULTS}/logs/train_flow/{{experiment}}.log",
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
        observation=of_its_subject("cohort/{subject}/observation.h5"),
        noise=f"{RESULTS}/cohort/noise.h5",
        estimator=FLOW,
    output:
        posterior=f"{RESULTS}/{{experiment}}/subjects/{{subject}}/posterior.h5",
    log:
        f"{RESULTS}/logs/exact_posterior/{{experiment}}/{{subject}}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.posterior.subject:posterior_of_subject"),
    script:
        "../scripts/stage.py"


rule verdict:
    """One verdict a subject, with the tests and features that say so."""
    input:
        posterior=f"{RESULTS}/{{experiment}}/subjects/{{subject}}/posterior.h5",
        null=nulls,
        observation=f"{RESULTS}/cohort/{{subject}}/observation.h5",
        contexts=f"{RESULTS}/cohort/contexts.h5",
        noise=f"{RESULTS}/cohort/noise.h5",
    output:
        verdict=reported(
            f"{RESULTS}/{{experiment}}/subjects/{{subject}}/verdict.json",
            "verdict",
            "verdict of the misspecification tests",
            subcategory="Subject {subject}",
        ),
    log:
        f"{RESULTS}/logs/verdict/{{experiment}}/{{subject}}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.verdict.subject:verdict_on_subject"),
    script:
        "../scripts/stage.py"


rule misspecification_figure:
    """The verdict's tests of every subject, and how often they raise an alarm."""
    input:
        table=f"{RESULTS}/{{experiment}}/alarms.csv",
        verdicts=of_experiment("{experiment}/subjects/{subject}/verdict.json"),
    output:
        figure_pdf=f"{RESULTS}/figures/misspecification-{{experiment}}.pdf",
        figure_png=drawn("misspecification_figure", "misspecification"),
    log:
        f"{RESULTS}/logs/misspecification_figure/{{experiment}}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.report.figures.misspecification:misspecification_figure"),
    script:
        "../scripts/stage.py"


rule noise_figure:
    """Noise between repeats and between samples: of each recording, and of the whole cohort."""
    input:
        noise=f"{RESULTS}/cohort/noise.h5",
    output:
        figure_pdf=f"{RESULTS}/figures/noise.pdf",
        figure_png=f"{RESULTS}/figures/noise.png",
    log:
        f"{RESULTS}/logs/noise_figure.log",
    params:
        **stage("swesbi.report.figures.recording:noise_figure"),
    script:
        "../scripts/stage.py"


rule identifiability:
    """Contraction, profiles of the exact likelihood, information of each phase, and other designs."""
    input:
        posteriors=of_experiment("{experiment}/subjects/{subject}/posterior.h5"),
        observations=of_experiment("cohort/{subject}/observation.h5"),
        noise=f"{RESULTS}/cohort/noise.h5",
    output:
        identifiability=f"{RESULTS}/{{experiment}}/identifiability.h5",
        summary=reported(
            f"{RESULTS}/{{experiment}}/identifiability.csv",
            "identifiability_table",
            "identifiability",
        ),
        information=reported(
            f"{RESULTS}/{{experiment}}/information.csv",
            "information",
            "information of the phases",
        ),
        design=reported(f"{RESULTS}/{{experiment}}/design.csv", "design", "designs"),
    log:
        f"{RESULTS}/logs/identifiability/{{experiment}}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.checks.identifiability.cohort:identifiability_of_cohort"),
    script:
        "../scripts/stage.py"


rule identifiability_figures:
    """What the recordings tell."""
    input:
        identifiability=rules.identifiability.output.identifiability,
    output:
        identifiability_pdf=f"{RESULTS}/figures/identifiability-{{experiment}}.pdf",
        identifiability_png=drawn("identifiability_figures", "identifiability"),
    log:
        f"{RESULTS}/logs/identifiability_figures/{{experiment}}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.report.figures.identifiability:draw_identifiability"),
    script:
        "../scripts/stage.py"


rule calibration_recordings:
    """Recordings of known parameters in one subject's context, inferred by the network and exactly."""
    input:
        observation=of_its_subject("cohort/{subject}/observation.h5"),
        noise=f"{RESULTS}/cohort/noise.h5",
        estimator=FLOW,
    output:
        recordings=f"{RESULTS}/{{experiment}}/subjects/{{subject}}/calibration_recordings.h5",
    log:
        f"{RESULTS}/logs/calibration_recordings/{{experiment}}/{{subject}}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.checks.calibration.subject:recordings_like_subject"),
    script:
        "../scripts/stage.py"


rule calibration_local:
    """Calibration at one subject's own data, and its samplers beside long Markov chains."""
    input:
        observation=f"{RESULTS}/cohort/{{subject}}/observation.h5",
        noise=f"{RESULTS}/cohort/noise.h5",
        estimator=FLOW,
        posterior=rules.exact_posterior.output.posterior,
    output:
        local=f"{RESULTS}/{{experiment}}/subjects/{{subject}}/calibration_local.h5",
    log:
        f"{RESULTS}/logs/calibration_local/{{experiment}}/{{subject}}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.checks.calibration.subject:calibration_at_subject"),
    script:
        "../scripts/stage.py"


rule calibration:
    """Every check of calibration, and the coverage of known parameters."""
    input:
        recordings=of_experiment(
            "{experiment}/subjects/{subject}/calibration_recordings.h5"
        ),
        local_parts=of_experiment(
            "{experiment}/subjects/{subject}/calibration_local.h5"
        ),
        null=nulls,
    output:
        calibration=f"{RESULTS}/{{experiment}}/calibration.h5",
        table=reported(
            f"{RESULTS}/{{experiment}}/calibration.csv",
            "calibration",
            "checks of calibration",
        ),
        alarms=reported(
            f"{RESULTS}/{{experiment}}/alarms.csv", "misspecification", "false alarms"
        ),
        recovery=reported(
            f"{RESULTS}/{{experiment}}/recovery.csv",
            "recovery_speeds",
            "recovery, own noise",
        ),
        recovery_acquisition=reported(
            f"{RESULTS}/{{experiment}}/recovery_acquisition.csv",
            "recovery_speeds",
            "recovery, acquisition noise",
        ),
    log:
        f"{RESULTS}/logs/calibration/{{experiment}}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.checks.calibration.cohort:calibration_of_cohort"),
    script:
        "../scripts/stage.py"


rule calibration_figure:
    """Ranks, coverage, weights and local calibration."""
    input:
        calibration=rules.calibration.output.calibration,
        table=rules.calibration.output.table,
    output:
        figure_pdf=f"{RESULTS}/figures/calibration-{{experiment}}.pdf",
        figure_png=drawn("calibration_figure", "calibration"),
    log:
        f"{RESULTS}/logs/calibration_figure/{{experiment}}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.report.figures.calibration:draw_calibration"),
    script:
        "../scripts/stage.py"
