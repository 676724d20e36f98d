"""Figures of one subject, and of the whole cohort."""


rule ppc_figure:
    input:
        predictive=rules.predictive.output.predictive,
        support=rules.posterior.output.support,
        cmaes=rules.cmaes.output.cmaes,
    output:
        figure=f"{RESULTS}/{{experiment}}/subjects/{{subject}}/ppc.png",
    log:
        f"{RESULTS}/logs/ppc_figure/{{experiment}}/{{subject}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/ppc_figure/{{experiment}}/{{subject}}.tsv"
    params:
        stage=stage("ppc_figure"),
    message:
        "Figure: predictive check of {wildcards.subject} ('{wildcards.experiment}')"
    script:
        "../scripts/ppc_figure.py"


rule posterior_figure:
    input:
        posterior=rules.posterior.output.posterior,
        support=rules.posterior.output.support,
        cmaes=rules.cmaes.output.cmaes,
    output:
        figure=f"{RESULTS}/{{experiment}}/subjects/{{subject}}/posterior.png",
    log:
        f"{RESULTS}/logs/posterior_figure/{{experiment}}/{{subject}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/posterior_figure/{{experiment}}/{{subject}}.tsv"
    params:
        stage=stage("posterior_figure"),
    message:
        "Figure: posterior of {wildcards.subject} ('{wildcards.experiment}')"
    script:
        "../scripts/posterior_figure.py"


rule cohort_figures:
    """Figures 2 and 3 of the paper, for the study's main experiment."""
    input:
        unpack(of_cohort(MAIN)),
    output:
        ppc_pdf=f"{RESULTS}/figures/ppc.pdf",
        ppc_png=f"{RESULTS}/figures/ppc.png",
        posterior_pdf=f"{RESULTS}/figures/posterior.pdf",
        posterior_png=f"{RESULTS}/figures/posterior.png",
    log:
        f"{RESULTS}/logs/cohort_figures.log",
    benchmark:
        f"{RESULTS}/benchmarks/cohort_figures.tsv"
    params:
        stage=stage("cohort_figures", experiment=MAIN),
    message:
        "Figures 2 and 3: predictive checks and posteriors of the cohort"
    script:
        "../scripts/cohort_figures.py"


rule training_figure:
    input:
        training=rules.train.output.training,
    output:
        figure_pdf=f"{RESULTS}/figures/training-{{experiment}}.pdf",
        figure_png=f"{RESULTS}/figures/training-{{experiment}}.png",
    log:
        f"{RESULTS}/logs/training_figure/{{experiment}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/training_figure/{{experiment}}.tsv"
    params:
        stage=stage("training_figure"),
    message:
        "Figure: training of the experiment '{wildcards.experiment}'"
    script:
        "../scripts/training_figure.py"
