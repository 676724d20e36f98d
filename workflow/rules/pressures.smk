"""Answers with the pressures of a cuff, where they were taken: beside those of a population's network on speeds."""


rule pressures:
    """The posterior of one subject from speeds and pressures."""
    input:
        observation=of_its_subject("<results>/cohort/{subject}/observation.h5"),
        noise="<results>/cohort/noise.h5",
        of_speeds="<results>/{experiment}/subjects/{subject}/posterior.h5",
    output:
        posterior="<results>/{experiment}/subjects/{subject}/with_pressures.h5",
    log:
        "<results>/logs/pressures/{experiment}/{subject}.log",
    wildcard_constraints:
        experiment=OVER_POPULATION,
    params:
        **stage("swesbi.answers.cohort:answer_with_pressures"),
    script:
        "../scripts/stage.py"


rule pressures_table:
    """Every quantity without and with pressures, of each subject that has them."""
    input:
        observations=[
            f"<results>/cohort/{subject}/observation.h5"
            for subject in SUBJECTS
            if any(subject in STUDY.with_pressures(name) for name in POPULATIONS)
        ],
        posteriors=with_pressures("posterior.h5"),
        with_pressures=with_pressures("with_pressures.h5"),
    output:
        table=reported(
            "<results>/tables/pressures.csv",
            "table_pressures",
            "what cuff pressures add",
            category="Tables",
        ),
    log:
        "<results>/logs/pressures_table.log",
    params:
        **stage("swesbi.checks.pressures:pressures_table"),
    script:
        "../scripts/stage.py"


rule pressures_figure:
    """What cuff pressures add, by subject and quantity."""
    input:
        table=rules.pressures_table.output.table,
    output:
        figure_pdf="<results>/figures/pressures-{experiment}.pdf",
        figure_png=drawn("pressures_figure", "pressures"),
    log:
        "<results>/logs/pressures_figure/{experiment}.log",
    wildcard_constraints:
        experiment=OVER_POPULATION,
    params:
        **stage("swesbi.report.figures.pressures:draw_pressures"),
    script:
        "../scripts/stage.py"
