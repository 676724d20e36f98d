"""What a study is asked for: figures, tables and pages; and what its landing page leads to."""

from swesbi.population.settings import MOST_SHOWN
from swesbi.report.figures.registry import names_of
from swesbi.report.page.names import FURTHER

IMAGES = ["pdf", "png"]
PAGES = ["<results>/index.html", *expand("<results>/report/{page}.html", page=FURTHER)]


def tables_of(experiments, *tables):
    """Return these tables of each of these experiments."""
    return expand(
        "<results>/{experiment}/{table}.csv", experiment=experiments, table=tables
    )


def figures_of(experiment, images=IMAGES):
    """Return the figures of an experiment over a population: those of pressures where there are any."""
    asked = {
        "pressures": STUDY.with_pressures(experiment),
        "cohort_posterior": STUDY.answered(experiment),
    }
    names = [*names_of("population"), *names_of("experiment")]
    return expand(
        f"<results>/figures/{{figure}}-{experiment}.{{image}}",
        figure=[name for name in names if asked.get(name, True)],
        image=images,
    )


def exact_experiments():
    """Return the experiments with exact posteriors that answer at least one subject."""
    return [*SPEED_EXPERIMENTS, *filter(STUDY.answered, POPULATIONS)]


def cohort_posteriors(experiments):
    """Return the posterior of the cohort in those of these experiments that answer a subject."""
    return expand(
        "<results>/{experiment}/{file}",
        experiment=[name for name in exact_experiments() if name in experiments],
        file=["cohort_posterior.h5", "cohort_posterior.csv", "cohort_subjects.csv"],
    )


def pressures_tables():
    """Return the table of what pressures add, which there is where any were taken."""
    there = any(map(STUDY.with_pressures, POPULATIONS))
    return ["<results>/tables/pressures.csv"] if there else []


def noise_files():
    """Return the cohort's noise, which only experiments on speeds need."""
    asked = SPEED_EXPERIMENTS or POPULATIONS
    return (
        ["<results>/cohort/noise.h5", "<results>/cohort/contexts.h5"] if asked else []
    )


def explorer_page():
    """Return the page on which the model is moved by hand, if an experiment on speeds runs."""
    asked = EXPLORER.is_file() and SPEED_EXPERIMENTS
    return ["<results>/explorer.html"] if asked else []


def shown_singly(experiment):
    """Return the subjects whose answers have figures of their own: all of a small cohort, none of a large one."""
    subjects = STUDY.subjects_of(experiment)
    return STUDY.answered(experiment) if len(subjects) <= MOST_SHOWN else ()


def of_shown(*files):
    """Return these files of every subject that is shown singly by an experiment over a population."""
    return [
        f"<results>/{experiment}/subjects/{subject}/{file}"
        for experiment in POPULATIONS
        for subject in shown_singly(experiment)
        for file in files
    ]


def of_subjects(experiments, *files):
    """Return these files of every subject of these experiments, subject by subject."""
    return [
        f"<results>/{experiment}/subjects/{subject}/{file}"
        for experiment in experiments
        for subject in STUDY.subjects_of(experiment)
        for file in files
    ]


def population_outputs():
    """Return figures and tables of the experiments over a population, which need no other experiment."""
    compared = [
        name
        for name in POPULATIONS
        if CONFIG.base_of(name) in EXPERIMENTS and shown_singly(name)
    ]
    return [
        *tables_of(POPULATIONS, "strata", "calibration", "recovery"),
        *tables_of(POPULATIONS, "recovery_acquisition", "alarms", "cohort"),
        *(path for experiment in POPULATIONS for path in figures_of(experiment)),
        *cohort_posteriors(POPULATIONS),
        *pressures_tables(),
        *tables_of(compared, "agreement"),
        *of_shown("ppc.png", "posterior.png"),
    ]


def cohort_outputs():
    """Return figures and tables of the experiments on the cohort, and the pages."""
    speeds = [*names_of("speeds")]
    return [
        *PAGES,
        *explorer_page(),
        *expand(
            "<results>/figures/{name}.{image}", name=names_of("cohort"), image=IMAGES
        ),
        *expand(
            "<results>/figures/noise.{image}", image=IMAGES if SPEED_EXPERIMENTS else []
        ),
        *expand("<results>/figures/training-{experiment}.png", experiment=EXPERIMENTS),
        *expand(
            "<results>/tables/{table}.{kind}",
            table=["ppc", "posterior", "paper_comparison"],
            kind=["csv", "tex"],
        ),
        *expand("<results>/tables/{table}.csv", table=["features", "statements"]),
        *("<results>/tables/truth.csv" for _ in truth_files()),
        *expand(
            "<results>/figures/{name}-{experiment}.{image}",
            name=speeds,
            experiment=SPEED_EXPERIMENTS,
            image=IMAGES,
        ),
        *tables_of(SPEED_EXPERIMENTS, "calibration", "alarms"),
        *tables_of(SPEED_EXPERIMENTS, "identifiability", "information", "design"),
        *cohort_posteriors(SPEED_EXPERIMENTS),
        *tables_of(EXPERIMENTS, "recovery", "recovery_acquisition"),
        *of_subjects(EXPERIMENTS, "ppc.png", "posterior.png"),
    ]


def study_outputs():
    """Return every figure and table of the study, and the page that shows them."""
    return [*(cohort_outputs() if EXPERIMENTS else []), *population_outputs()]


def linked_artefacts():
    """Return the results that the landing page leads to, in the order in which it lists them."""
    shown = [path for path in study_outputs() if path not in PAGES]
    of_subject = ["verdict.json", "posterior.h5", "predictive.h5"]
    return [
        *explorer_page(),
        *(path for path in shown if path.startswith("<results>/tables/")),
        *(path for path in shown if path.startswith("<results>/figures/")),
        *expand("<results>/figures/training-{experiment}.pdf", experiment=EXPERIMENTS),
        *expand(
            "<results>/{experiment}/{file}",
            experiment=EXPERIMENTS,
            file=["pool.h5", "training.csv"],
        ),
        *expand(
            "<results>/{experiment}/{file}.pt",
            experiment=FEATURE_EXPERIMENTS,
            file=["estimator", "checkpoints"],
        ),
        *expand(
            "<results>/{experiment}/{file}.h5",
            experiment=SPEED_EXPERIMENTS,
            file=["flow", "calibration", "identifiability"],
        ),
        *tables_of([MAIN], "epochs"),
        *expand(
            "<results>/{experiment}/{file}",
            experiment=POPULATIONS,
            file=["flow.h5", "training.csv", "calibration.h5"],
        ),
        *expand(
            "<results>/{experiment}/{file}-{part}.h5",
            experiment=POPULATIONS,
            file=["simulations/shard", "calibration/part"],
            part=PARTS,
        ),
        *of_shown(*of_subject),
        *with_pressures("with_pressures.h5"),
        *of_subjects(EXPERIMENTS, *of_subject),
        *of_subjects(
            SPEED_EXPERIMENTS, "calibration_recordings.h5", "calibration_local.h5"
        ),
        *shown,
        *expand(
            "<results>/cohort/{subject}/{file}.h5",
            subject=SHOWN,
            file=["observation", "passive"],
        ),
        *noise_files(),
        *expand("<results>/cmaes/{subject}.h5", subject=SHOWN),
        *dict.fromkeys(
            path
            for experiment in EXPERIMENTS
            for path in shards_of(experiment, STUDY.subjects_of(experiment))
        ),
    ]
