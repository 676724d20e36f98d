"""Experiments over a population: simulations -> flow -> calibration on fresh contexts, nulls, answers."""


rule population_simulate:
    """Contexts drawn from the population, draws of theta in each, at the nominal phases."""
    output:
        shard="<results>/{experiment}/simulations/shard-{shard}.h5",
    log:
        "<results>/logs/population_simulate/{experiment}/{shard}.log",
    wildcard_constraints:
        experiment=OVER_POPULATION,
    priority: 100
    params:
        **stage("swesbi.population.simulations:shard_of_population"),
    script:
        "../scripts/stage.py"


rule train_population:
    """The network of an experiment over a population, in minutes; its log says how long it will still take."""
    input:
        shards=expand(rules.population_simulate.output.shard, shard=PARTS, allow_missing=True),
    output:
        estimator=FLOW,
        training="<results>/{experiment}/training.csv",
    log:
        "<results>/logs/train_population/{experiment}.log",
    wildcard_constraints:
        experiment=NONE if CONFIG.networks else OVER_POPULATION,
    priority: 95
    params:
        **stage("swesbi.population.training:trained_over_population"),
    script:
        "../scripts/stage.py"


rule population_calibration:
    """Recordings of fresh contexts with known parameters, inferred by the network and exactly."""
    input:
        estimator=FLOW,
    output:
        part="<results>/{experiment}/calibration/part-{part}.h5",
    log:
        "<results>/logs/population_calibration/{experiment}/{part}.log",
    wildcard_constraints:
        experiment=OVER_POPULATION,
    params:
        **stage("swesbi.checks.calibration.known:calibration_on_fresh"),
    script:
        "../scripts/stage.py"


rule population_scores:
    """Coverage, ranks and contraction over all fresh contexts, and coverage by stratum."""
    input:
        parts=expand(rules.population_calibration.output.part, part=PARTS, allow_missing=True),
        null=nulls,
    output:
        calibration="<results>/{experiment}/calibration.h5",
        alarms="<results>/{experiment}/alarms.csv",
        table=reported(
            "<results>/{experiment}/calibration.csv",
            "population_calibration",
            "checks",
            subcategory="Calibration",
        ),
        strata=reported(
            "<results>/{experiment}/strata.csv",
            "population_strata",
            "coverage by stratum",
            subcategory="Calibration",
        ),
        recovery="<results>/{experiment}/recovery.csv",
        recovery_acquisition="<results>/{experiment}/recovery_acquisition.csv",
    log:
        "<results>/logs/population_scores/{experiment}.log",
    wildcard_constraints:
        experiment=OVER_POPULATION,
    params:
        **stage("swesbi.checks.calibration.scores:scores_on_fresh"),
    script:
        "../scripts/stage.py"


rule pushes_calibration:
    """Free-running recordings of fresh contexts, of several numbers of pushes; not part of the study."""
    input:
        estimator=FLOW,
    output:
        part="<results>/{experiment}/pushes/part-{part}.h5",
    log:
        "<results>/logs/pushes_calibration/{experiment}/{part}.log",
    wildcard_constraints:
        experiment=OVER_POPULATION,
    params:
        **stage("swesbi.checks.calibration.known:pushes_on_fresh"),
    script:
        "../scripts/stage.py"


rule pushes_table:
    """Coverage by number of pushes."""
    input:
        parts=expand(rules.pushes_calibration.output.part, part=PARTS, allow_missing=True),
        null=nulls,
    output:
        calibration="<results>/{experiment}/pushes.h5",
        table="<results>/{experiment}/pushes.csv",
    log:
        "<results>/logs/pushes_table/{experiment}.log",
    wildcard_constraints:
        experiment=OVER_POPULATION,
    params:
        **stage("swesbi.checks.calibration.scores:scores_on_pushes"),
    script:
        "../scripts/stage.py"


rule population_null:
    """Well-specified recordings of fresh contexts: the nulls of the tests, where those of the package are of another model."""
    input:
        estimator=FLOW,
    output:
        null="<results>/{experiment}/null.h5",
    log:
        "<results>/logs/population_null/{experiment}.log",
    wildcard_constraints:
        experiment=OVER_POPULATION,
    params:
        **stage("swesbi.verdict.null_recordings:null_recordings"),
    script:
        "../scripts/stage.py"


rule population_answers:
    """Posterior, verdict and predictive check of one subject without pressures."""
    input:
        observation=of_its_subject(OBSERVATION),
        noise=NOISE,
        estimator=FLOW,
        null=nulls,
    output:
        posterior=POSTERIOR,
        verdict=VERDICT,
        predictive=PREDICTIVE,
    log:
        "<results>/logs/population_answers/{experiment}/{subject}.log",
    wildcard_constraints:
        experiment=OVER_POPULATION,
        subject=WITHOUT_PRESSURES,
    params:
        **stage("swesbi.answers.answer:answer_of_population"),
    script:
        "../scripts/stage.py"


use rule population_answers as population_answers_with_pressures with:
    output:
        posterior=POSTERIOR,
        verdict=VERDICT,
        predictive=PREDICTIVE,
        with_pressures="<results>/{experiment}/subjects/{subject}/with_pressures.h5",
    log:
        "<results>/logs/population_answers_with_pressures/{experiment}/{subject}.log",
    wildcard_constraints:
        experiment=OVER_POPULATION,
        subject=WITH_PRESSURES,


rule population_cohort:
    """Every subject of the cohort in one table and one figure, those refused with the reason."""
    input:
        verdicts=of_experiment(VERDICT),
        truth=TRUTH_FILES,
    output:
        cohort=reported(
            "<results>/{experiment}/cohort.csv",
            "population_table",
            "answers and verdicts",
        ),
        figure_pdf="<results>/figures/cohort-{experiment}.pdf",
        figure_png=drawn("population_cohort", "cohort"),
    log:
        "<results>/logs/population_cohort/{experiment}.log",
    wildcard_constraints:
        experiment=OVER_POPULATION,
    params:
        **stage("swesbi.report.figures.cohort:population_cohort"),
    script:
        "../scripts/stage.py"


rule strata_figure:
    """Coverage of credible intervals and efficiency of the weights, by stratum."""
    input:
        strata=rules.population_scores.output.strata,
    output:
        figure_pdf="<results>/figures/strata-{experiment}.pdf",
        figure_png=drawn("strata_figure", "strata"),
    log:
        "<results>/logs/strata_figure/{experiment}.log",
    wildcard_constraints:
        experiment=OVER_POPULATION,
    params:
        **stage("swesbi.report.figures.calibration:draw_strata"),
    script:
        "../scripts/stage.py"


rule population_agreement:
    """Draws of each subject compared with the exact ones of the experiment that shares its model, by a classifier."""
    input:
        posteriors=of_experiment(POSTERIOR),
        base_posteriors=lambda by: expand(
            POSTERIOR,
            experiment=CONFIG.base_of(by.experiment),
            subject=STUDY.answered(by.experiment),
        ),
    output:
        table=reported(
            "<results>/{experiment}/agreement.csv",
            "population_agreement",
            "agreement with the network of the cohort",
        ),
    log:
        "<results>/logs/population_agreement/{experiment}.log",
    wildcard_constraints:
        experiment=OVER_POPULATION,
    params:
        **stage("swesbi.checks.calibration.local:agreement_of_networks"),
    script:
        "../scripts/stage.py"
