"""The cohort as a posterior: what its population is like, and every subject within it."""


rule cohort_posterior:
    input:
        posteriors=of_exact("{experiment}/subjects/{subject}/posterior.h5"),
        verdicts=of_exact("{experiment}/subjects/{subject}/verdict.json"),
        observations=of_exact("cohort/{subject}/observation.h5"),
        noise=f"{RESULTS}/cohort/noise.h5",
    output:
        cohort_posterior=f"{RESULTS}/{{experiment}}/cohort_posterior.h5",
        table=report(
            f"{RESULTS}/{{experiment}}/cohort_posterior.csv",
            caption="../report/cohort_posterior.rst",
            category="Experiment {experiment}",
            subcategory="Whole cohort",
            labels={"result": "the population"},
        ),
        subjects=report(
            f"{RESULTS}/{{experiment}}/cohort_subjects.csv",
            caption="../report/cohort_subjects.rst",
            category="Experiment {experiment}",
            subcategory="Whole cohort",
            labels={"result": "every subject within the population"},
        ),
    log:
        f"{RESULTS}/logs/cohort_posterior/{{experiment}}.log",
    wildcard_constraints:
        experiment=EXACT,
    params:
        **stage("swesbi.persons.cohort.posterior:posterior_of_cohort"),
    message:
        "Posterior of the cohort in '{wildcards.experiment}': its population, and each subject within it"
    script:
        "../scripts/stage.py"


rule cohort_posterior_figure:
    input:
        cohort_posterior=rules.cohort_posterior.output.cohort_posterior,
    output:
        figure_pdf=f"{RESULTS}/figures/cohort_posterior-{{experiment}}.pdf",
        figure_png=drawn("cohort_posterior_figure", "cohort_posterior"),
    log:
        f"{RESULTS}/logs/cohort_posterior_figure/{{experiment}}.log",
    wildcard_constraints:
        experiment=EXACT,
    params:
        **stage("swesbi.report.figures.cohort_posterior:draw_cohort_posterior"),
    message:
        "Figure: the cohort of '{wildcards.experiment}' as a posterior"
    script:
        "../scripts/stage.py"
