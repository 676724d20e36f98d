"""The cohort as a posterior: what its population is like, and every subject within it."""


rule cohort_posterior:
    """The population of a cohort as a posterior, and each subject within it."""
    input:
        posteriors=of_experiment(POSTERIOR),
        verdicts=of_experiment(VERDICT),
        observations=of_experiment(OBSERVATION),
        noise=NOISE,
    output:
        cohort_posterior="<results>/{experiment}/cohort_posterior.h5",
        table=reported(
            "<results>/{experiment}/cohort_posterior.csv",
            "cohort_posterior",
            "the population",
        ),
        subjects=reported(
            "<results>/{experiment}/cohort_subjects.csv",
            "cohort_subjects",
            "every subject within the population",
        ),
    log:
        "<results>/logs/cohort_posterior/{experiment}.log",
    wildcard_constraints:
        experiment=EXACT,
    params:
        **stage("swesbi.persons.cohort.infer:posterior_of_cohort"),
    script:
        "../scripts/stage.py"


rule cohort_posterior_figure:
    """Every subject before and after the population is taken into account, and the groups."""
    input:
        cohort_posterior=rules.cohort_posterior.output.cohort_posterior,
    output:
        figure_pdf="<results>/figures/cohort_posterior-{experiment}.pdf",
        figure_png=drawn("cohort_posterior_figure", "cohort_posterior"),
    log:
        "<results>/logs/cohort_posterior_figure/{experiment}.log",
    wildcard_constraints:
        experiment=EXACT,
    params:
        **stage("swesbi.report.figures.cohort_posterior:draw_cohort_posterior"),
    script:
        "../scripts/stage.py"
