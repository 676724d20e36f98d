"""Statistics in large sizes, with networks of a study that has finished: `make full`."""

if CONFIG.networks:

    rule take_network:
        """The network that another study trained, where the configuration says which."""
        input:
            estimator=f"{CONFIG.networks}/{{experiment}}/flow.h5",
        output:
            estimator=FLOW,
        wildcard_constraints:
            experiment=EXACT,
        shell:
            "cp {input.estimator:q} {output.estimator:q}"


rule checks:
    """Every table of calibration: coverage, ranks, strata, alarms, by number of pushes."""
    input:
        tables_of(SPEED_EXPERIMENTS, "calibration", "alarms"),
        tables_of(POPULATIONS, "calibration", "alarms", "strata", "pushes"),
        tables_of(
            [*SPEED_EXPERIMENTS, *POPULATIONS], "recovery", "recovery_acquisition"
        ),
