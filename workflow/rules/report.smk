"""The landing page of the results."""


def linked_artefacts():
    """Return the results that the page leads to, in the order in which it lists them."""
    shown = [path for path in study_outputs() if path != f"{RESULTS}/report.html"]
    of_experiment = ["pool.h5", "estimator.pt", "checkpoints.pt", "training.csv"]
    of_subject = ["support.json", "posterior.h5", "predictive.h5"]
    priors = dict.fromkeys(CONFIG.experiments[name].prior for name in EXPERIMENTS)
    return [
        *(path for path in shown if path.startswith(f"{RESULTS}/tables/")),
        *(path for path in shown if path.startswith(f"{RESULTS}/figures/")),
        *expand(rules.training_figure.output.figure_pdf, experiment=EXPERIMENTS),
        *expand(
            f"{RESULTS}/{{experiment}}/{{file}}",
            experiment=EXPERIMENTS,
            file=of_experiment,
        ),
        *expand(rules.epochs.output.epochs, experiment=MAIN),
        *expand(
            f"{RESULTS}/{{experiment}}/subjects/{{subject}}/{{file}}",
            experiment=EXPERIMENTS,
            subject=SUBJECTS,
            file=of_subject,
        ),
        *shown,
        *expand(
            f"{RESULTS}/cohort/{{subject}}/{{file}}.h5",
            subject=SUBJECTS,
            file=["observation", "passive"],
        ),
        *of_subjects("cmaes/{subject}.h5"),
        *expand(
            f"{RESULTS}/simulations/{{prior}}/{{subject}}/shard-{{shard}}.h5",
            prior=priors,
            subject=SUBJECTS,
            shard=SHARDS,
        ),
    ]


rule report:
    """A page that is read without Snakemake: verdicts, figures, tables, and where every file lies."""
    input:
        recording=str(STUDY.cohort / "recording.yaml"),
        observations=of_subjects("cohort/{subject}/observation.h5"),
        supports=expand(
            rules.posterior.output.support, experiment=EXPERIMENTS, subject=SUBJECTS
        ),
        trainings=expand(rules.train.output.training, experiment=EXPERIMENTS),
        recoveries=expand(rules.recovery.output.recovery, experiment=EXPERIMENTS),
        recovery_acquisitions=expand(
            rules.recovery_acquisition.output.recovery_acquisition,
            experiment=EXPERIMENTS,
        ),
        ppc_csv=rules.tables.output.ppc_csv,
        features_csv=rules.tables.output.features_csv,
        posterior_csv=rules.tables.output.posterior_csv,
        comparison_csv=rules.paper_comparison.output.comparison_csv,
        workflow_png=rules.workflow_figure.output.figure_png,
        workflow_pdf=rules.workflow_figure.output.figure_pdf,
        ppc_png=rules.cohort_figures.output.ppc_png,
        ppc_pdf=rules.cohort_figures.output.ppc_pdf,
        posterior_png=rules.cohort_figures.output.posterior_png,
        posterior_pdf=rules.cohort_figures.output.posterior_pdf,
        experiments_png=rules.experiments_figure.output.figure_png,
        experiments_pdf=rules.experiments_figure.output.figure_pdf,
        epochs_png=rules.epochs_figure.output.figure_png,
        epochs_pdf=rules.epochs_figure.output.figure_pdf,
        training_pngs=expand(
            rules.training_figure.output.figure_png, experiment=EXPERIMENTS
        ),
        artefacts=linked_artefacts(),
    output:
        report=f"{RESULTS}/report.html",
        configuration=report(
            f"{RESULTS}/configuration.yaml",
            caption="../report/configuration.rst",
            category="Configuration",
            labels={"result": "every choice of this run"},
        ),
    log:
        f"{RESULTS}/logs/report.log",
    benchmark:
        f"{RESULTS}/benchmarks/report.tsv"
    params:
        stage=stage("report"),
    message:
        "Landing page of the results"
    script:
        "../scripts/report.py"
