"""What a study is asked for: figures, tables and pages; and what its landing page leads to."""

from swesbi.population.settings import MOST_SHOWN
from swesbi.report.figures.registry import names_of
from swesbi.report.page.names import FURTHER

IMAGES = ["pdf", "png"]
PAGES = ["<results>/index.html", *expand("<results>/report/{page}.html", page=FURTHER)]
OF_POPULATION = [*names_of("population"), *names_of("experiment")]
# what some studies have no need of, or nothing to make of
TRUTH_TABLES = ["<results>/tables/truth.csv"] if TRUTH_FILES else []
PRESSURES_TABLES = ["<results>/tables/pressures.csv"] if any(map(STUDY.with_pressures, POPULATIONS)) else []
NOISE_FILES = [NOISE, "<results>/cohort/contexts.h5"] if SPEED_EXPERIMENTS or POPULATIONS else []
NOISE_FIGURES = names_of("recordings") if SPEED_EXPERIMENTS else []
EXPLORER_PAGES = ["<results>/explorer.html"] if EXPLORER.is_file() and SPEED_EXPERIMENTS else []


def files_of(experiments, *files):
    """Return these files of each of these experiments."""
    return expand("<results>/{experiment}/{file}", experiment=experiments, file=files)


def of_subjects(experiments, *files, subjects=STUDY.answered):
    """Return these files of every subject of these experiments, subject by subject."""
    pattern = "<results>/{experiment}/subjects/{subject}/{file}"
    return paths_of(pattern, *experiments, subjects=subjects, file=files)


def figures_of(experiments, names, images=IMAGES):
    """Return these figures of each of these experiments, where there is something to draw."""
    needed = {"pressures": STUDY.with_pressures, "cohort_posterior": STUDY.answered}
    return [
        f"<results>/figures/{name}-{experiment}.{image}"
        for experiment in experiments
        for name in names
        if name not in needed or needed[name](experiment)
        for image in images
    ]


def cohort_posteriors(experiments):
    """Return the posterior of the cohort in those of these experiments that answer a subject."""
    return files_of(
        [name for name in experiments if STUDY.answered(name)],
        "cohort_posterior.h5",
        "cohort_posterior.csv",
        "cohort_subjects.csv",
    )


def shown_singly(experiment):
    """Return the subjects whose answers have figures of their own: all of a small cohort, none of a large one."""
    subjects = STUDY.subjects_of(experiment)
    return STUDY.answered(experiment) if len(subjects) <= MOST_SHOWN else ()


def population_outputs():
    """Return figures and tables of the experiments over a population, which need no other experiment."""
    compared = [name for name in POPULATIONS if CONFIG.base_of(name) in EXPERIMENTS and shown_singly(name)]
    return [
        *files_of(POPULATIONS, "strata.csv", "calibration.csv", "recovery.csv"),
        *files_of(POPULATIONS, "recovery_acquisition.csv", "alarms.csv", "cohort.csv"),
        *figures_of(POPULATIONS, OF_POPULATION),
        *cohort_posteriors(POPULATIONS),
        *PRESSURES_TABLES,
        *files_of(compared, "agreement.csv"),
        *of_subjects(POPULATIONS, "ppc.png", "posterior.png", subjects=shown_singly),
    ]


def cohort_outputs():
    """Return figures and tables of the experiments on the cohort, and the pages."""
    return [
        *PAGES,
        *EXPLORER_PAGES,
        *expand(
            "<results>/figures/{name}.{image}",
            name=[*names_of("cohort"), *NOISE_FIGURES],
            image=IMAGES,
        ),
        *figures_of(EXPERIMENTS, names_of("experiment"), ["png"]),
        *expand(
            "<results>/tables/{table}.{kind}",
            table=["ppc", "posterior"],
            kind=["csv", "tex"],
        ),
        *expand(
            "<results>/tables/{table}.csv",
            table=["features", "paper_comparison", "statements"],
        ),
        *TRUTH_TABLES,
        *figures_of(SPEED_EXPERIMENTS, names_of("speeds")),
        *files_of(SPEED_EXPERIMENTS, "calibration.csv", "alarms.csv"),
        *files_of(
            SPEED_EXPERIMENTS,
            "identifiability.csv",
            "correlations.csv",
            "information.csv",
        ),
        *cohort_posteriors(SPEED_EXPERIMENTS),
        *files_of(EXPERIMENTS, "recovery.csv", "recovery_acquisition.csv"),
        *of_subjects(EXPERIMENTS, "ppc.png", "posterior.png"),
    ]


def study_outputs():
    """Return every figure and table of the study, and the page that shows them."""
    return [*(cohort_outputs() if EXPERIMENTS else []), *population_outputs()]


def linked_artefacts():
    """Return the results that the landing page leads to, in the order in which it lists them."""
    shown = [path for path in study_outputs() if path not in PAGES]
    of_subject = ["verdict.json", "posterior.h5", "predictive.h5"]
    of_part = expand("{file}-{part}.h5", file=["simulations/shard", "calibration/part"], part=PARTS)
    return [
        *EXPLORER_PAGES,
        *(path for path in shown if path.startswith("<results>/tables/")),
        *(path for path in shown if path.startswith("<results>/figures/")),
        *figures_of(EXPERIMENTS, names_of("experiment"), ["pdf"]),
        *files_of(EXPERIMENTS, "pool.h5", "training.csv"),
        *files_of(FEATURE_EXPERIMENTS, "estimator.h5", "checkpoints.h5"),
        *files_of(SPEED_EXPERIMENTS, "flow.h5", "calibration.h5"),
        *files_of([MAIN], "epochs.csv"),
        *files_of(POPULATIONS, "flow.h5", "training.csv", "calibration.h5"),
        *files_of(POPULATIONS, *of_part),
        *of_subjects(POPULATIONS, *of_subject, subjects=shown_singly),
        *of_subjects(POPULATIONS, "with_pressures.h5", subjects=STUDY.with_pressures),
        *of_subjects(EXPERIMENTS, *of_subject),
        *of_subjects(SPEED_EXPERIMENTS, "calibration_recordings.h5", "calibration_local.h5"),
        *shown,
        *expand(
            "<results>/cohort/{subject}/{file}.h5",
            subject=SHOWN,
            file=["observation", "passive"],
        ),
        *NOISE_FILES,
        *expand(CMAES, subject=SHOWN),
        *dict.fromkeys(
            path
            for experiment in EXPERIMENTS
            for path in shards_of(experiment, STUDY.subjects_of(experiment))
        ),
    ]
