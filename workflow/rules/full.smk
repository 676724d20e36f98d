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
        files_of(
            [*SPEED_EXPERIMENTS, *POPULATIONS],
            "calibration.csv",
            "alarms.csv",
            "recovery.csv",
            "recovery_acquisition.csv",
        ),
        files_of(POPULATIONS, "strata.csv", "pushes.csv"),
