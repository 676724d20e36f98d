"""A ladder of structures: the same recordings under other equations; not part of the study."""

LADDER = CONFIG.ladder.experiment


rule ladder_run:
    input:
        observations=paths_of("cohort/{subject}/observation.h5", LADDER),
        noise=f"{RESULTS}/cohort/noise.h5",
        estimator=f"{RESULTS}/{LADDER}/flow.h5",
    output:
        posteriors=f"{RESULTS}/ladder/{{structure}}.h5",
    log:
        f"{RESULTS}/logs/ladder_run/{{structure}}.log",
    wildcard_constraints:
        structure="|".join(CONFIG.ladder.structures),
    params:
        stage=stage("ladder_run", experiment=LADDER),
    message:
        "Posteriors under the structure '{wildcards.structure}' (minutes; progress below)"
    script:
        "../scripts/stage.py"


rule ladder:
    input:
        structures=expand(
            rules.ladder_run.output.posteriors,
            structure=CONFIG.ladder.structures,
        ),
    output:
        table=f"{RESULTS}/tables/ladder.csv",
        pairs=f"{RESULTS}/tables/ladder_pairs.csv",
        moves=f"{RESULTS}/tables/ladder_moves.csv",
        figure_pdf=f"{RESULTS}/figures/ladder.pdf",
        figure_png=f"{RESULTS}/figures/ladder.png",
    log:
        f"{RESULTS}/logs/ladder.log",
    params:
        stage=stage("ladder", experiment=LADDER),
    message:
        "Tables and figure of the ladder of structures"
    script:
        "../scripts/stage.py"
