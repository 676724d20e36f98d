"""Answers with the pressures of a cuff, where they were taken: beside those of a population's network on speeds."""


rule pressures:
    """The posterior of one subject from speeds and pressures."""
    input:
        observations=of_its_subject("cohort/{subject}/observation.h5"),
        noise=f"{RESULTS}/cohort/noise.h5",
        estimator=FLOW,
    output:
        posteriors=f"{RESULTS}/{{experiment}}/subjects/{{subject}}/with_pressures.h5",
    log:
        f"{RESULTS}/logs/pressures/{{experiment}}/{{subject}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/pressures/{{experiment}}/{{subject}}.tsv"
    wildcard_constraints:
        experiment=OVER_POPULATION,
    params:
        stage=stage("pressures"),
    message:
        "Answer of '{wildcards.experiment}' with pressures for {wildcards.subject}"
    script:
        "../scripts/stage.py"


# A rule a batch: files of a batch have no name in common that a wildcard could stand for.
for experiment, number, batch in batches_of_populations(STUDY.with_pressures):

    rule:
        name:
            f"pressures_{experiment}_{number}"
        input:
            observations=expand(
                f"{RESULTS}/cohort/{{subject}}/observation.h5", subject=batch
            ),
            noise=f"{RESULTS}/cohort/noise.h5",
            estimator=f"{RESULTS}/{experiment}/flow.h5",
        output:
            posteriors=expand(
                f"{RESULTS}/{experiment}/subjects/{{subject}}/with_pressures.h5",
                subject=batch,
            ),
        log:
            f"{RESULTS}/logs/pressures/{experiment}/{number}.log",
        benchmark:
            f"{RESULTS}/benchmarks/pressures/{experiment}/{number}.tsv"
        resources:
            # of a profile for a cluster, which cannot name rules that depend on the cohort
            mem_mb=2000,
            runtime=5 + len(batch),
        params:
            stage=stage("pressures", experiment=experiment),
        message:
            f"Answers of '{experiment}' with pressures for {', '.join(batch)}"
        script:
            "../scripts/stage.py"


rule pressures_table:
    """Every quantity without and with pressures, of each subject that has them."""
    input:
        observations=[
            f"{RESULTS}/cohort/{subject}/observation.h5"
            for subject in SUBJECTS
            if any(subject in STUDY.with_pressures(name) for name in POPULATIONS)
        ],
        posteriors=of_those_with_pressures("posterior.h5"),
        with_pressures=of_those_with_pressures("with_pressures.h5"),
    output:
        table=report(
            f"{RESULTS}/tables/pressures.csv",
            caption="../report/table_pressures.rst",
            category="Tables",
            labels={"result": "what cuff pressures add"},
        ),
    log:
        f"{RESULTS}/logs/pressures_table.log",
    benchmark:
        f"{RESULTS}/benchmarks/pressures_table.tsv"
    params:
        stage=stage("pressures_table"),
    message:
        "Table: what cuff pressures add to the answers on speeds"
    script:
        "../scripts/stage.py"


rule pressures_figure:
    input:
        table=rules.pressures_table.output.table,
    output:
        figure_pdf=f"{RESULTS}/figures/pressures-{{experiment}}.pdf",
        figure_png=drawn("pressures_figure", "pressures"),
    log:
        f"{RESULTS}/logs/pressures_figure/{{experiment}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/pressures_figure/{{experiment}}.tsv"
    wildcard_constraints:
        experiment=OVER_POPULATION,
    params:
        stage=stage("pressures_figure"),
    message:
        "Figure: what cuff pressures add to '{wildcards.experiment}'"
    script:
        "../scripts/stage.py"
