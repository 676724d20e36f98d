"""What the pressures of a cuff add to the answers of a population's network, where they were taken."""


rule pressures_table:
    """Every quantity without and with pressures, of each subject that has them."""
    input:
        observations=paths_of(OBSERVATION, *POPULATIONS, subjects=STUDY.with_pressures),
        posteriors=paths_of(POSTERIOR, *POPULATIONS, subjects=STUDY.with_pressures),
        with_pressures=of_subjects(POPULATIONS, "with_pressures.h5", subjects=STUDY.with_pressures),
    output:
        table=reported(
            "<results>/tables/pressures.csv",
            "table_pressures",
            "what cuff pressures add",
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
        **stage("swesbi.report.figures.cohort:draw_pressures"),
    script:
        "../scripts/stage.py"
