"""Figures of one subject, and of the whole cohort."""


rule subject_figures:
    """Predictive check and posterior of one subject."""
    input:
        predictive=rules.predictive.output.predictive,
        posterior=rules.posterior.output.posterior,
        verdict=rules.posterior.output.verdict,
        cmaes=rules.cmaes.output.cmaes,
    output:
        ppc_png=drawn("subject_figures", "ppc"),
        posterior_png=drawn("subject_figures", "posterior"),
    log:
        "<results>/logs/subject_figures/{experiment}/{subject}.log",
    wildcard_constraints:
        experiment=FEATURES,
    params:
        **stage("swesbi.report.figures.subjects:subject_figures"),
    script:
        "../scripts/stage.py"


rule exact_subject_figures:
    """Predictive check and exact posterior of one subject, on speeds or over a population."""
    input:
        predictive=rules.predictive.output.predictive,
        posterior=of_its_subject(POSTERIOR),
        verdict=VERDICT,
        cmaes=rules.cmaes.output.cmaes,
        truth=TRUTH_FILES,
    output:
        ppc_png=drawn("exact_subject_figures", "ppc"),
        posterior_png=drawn("exact_subject_figures", "posterior"),
    log:
        "<results>/logs/exact_subject_figures/{experiment}/{subject}.log",
    wildcard_constraints:
        experiment=EXACT,
    params:
        **stage("swesbi.report.figures.subjects:exact_subject_figures"),
    script:
        "../scripts/stage.py"


rule exact_figures:
    """Predictive checks and exact posteriors of the cohort, for each experiment on speeds."""
    input:
        unpack(lambda by: shown_of(by.experiment)),
        truth=TRUTH_FILES,
    output:
        ppc_pdf="<results>/figures/ppc-{experiment}.pdf",
        ppc_png=drawn("exact_figures", "ppc"),
        posterior_pdf="<results>/figures/posterior-{experiment}.pdf",
        posterior_png=drawn("exact_figures", "posterior"),
    log:
        "<results>/logs/exact_figures/{experiment}.log",
    wildcard_constraints:
        experiment=SPEEDS,
    params:
        **stage("swesbi.report.figures.subjects:exact_figures"),
    script:
        "../scripts/stage.py"


rule cohort_figures:
    """Figures 2 and 3 of the paper, for the study's main experiment."""
    input:
        **shown_of(MAIN),
    output:
        ppc_pdf="<results>/figures/ppc.pdf",
        ppc_png=drawn("cohort_figures", "ppc"),
        posterior_pdf="<results>/figures/posterior.pdf",
        posterior_png=drawn("cohort_figures", "posterior"),
    log:
        "<results>/logs/cohort_figures.log",
    params:
        **stage("swesbi.report.figures.subjects:cohort_figures", experiment=MAIN),
    script:
        "../scripts/stage.py"


rule training_figure:
    """Losses of a network, epoch by epoch."""
    input:
        training=rules.train.output.training,
    output:
        figure_pdf="<results>/figures/training-{experiment}.pdf",
        figure_png=drawn("training_figure", "training"),
    log:
        "<results>/logs/training_figure/{experiment}.log",
    params:
        **stage("swesbi.report.figures.calibration:draw_training"),
    script:
        "../scripts/stage.py"


rule workflow_figure:
    """Figure 1 of the paper, drawn from the results of the first subject whose posterior may be read."""
    input:
        pool=f"<results>/{MAIN}/pool.h5",
        training=f"<results>/{MAIN}/training.csv",
        predictives=paths_of(PREDICTIVE, MAIN),
        posteriors=paths_of(POSTERIOR, MAIN),
        verdicts=paths_of(VERDICT, MAIN),
    output:
        figure_pdf="<results>/figures/workflow.pdf",
        figure_png=drawn("workflow_figure", "workflow"),
    log:
        "<results>/logs/workflow_figure.log",
    params:
        **stage("swesbi.report.figures.workflow:workflow_figure", experiment=MAIN),
    script:
        "../scripts/stage.py"
