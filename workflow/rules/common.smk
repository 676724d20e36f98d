"""The validated study, and what is taken from it everywhere: paths, subjects, params of the stages."""

import os
import re
import sys
from pathlib import Path

from swesbi.config.read import (
    DATA,
    ConfigError,
    overlay,
    parts_of,
    read_merged,
    relocate,
    typed_again,
)
from swesbi.config.study import load_study
from swesbi.config.view import View
from swesbi.report.figures.registry import captions, figure_of, names_of
from swesbi.report.page.names import FURTHER
from swesbi.population.settings import MOST_SHOWN
from swesbi.study.running import RUN
from swesbi.study.running import check_dates, current_run, guard_run
from swesbi.study.nulls import nulls_of
from swesbi.study.stage import stage_params

# The shipped configuration lies below what --configfile, --config or a workflow that imports this one say.
# Paths in files from elsewhere count from their own folders.
# In another folder than the project's, recordings are the project's and results lie there.
PROJECT = Path(str(workflow.current_basedir)).parents[1]
EXPLORER = PROJECT / "explorer/rules.smk"  # of a package that the study runs without
try:
    config |= overlay(read_merged(PROJECT / "config.yaml"), config)
    config |= typed_again(config, workflow.config_settings.config_args or ())
    relocate(config, PROJECT / "config.yaml", Path.cwd(), DATA)
    for file in workflow.overwrite_configfiles:
        relocate(config, Path(file), Path.cwd())
    STUDY = load_study(
        config,
        "configuration (config.yaml with what is merged over it)",
        files=[*parts_of(PROJECT / "config.yaml"), *workflow.overwrite_configfiles],
    )
except ConfigError as error:
    raise WorkflowError(str(error)) from None

CONFIG = STUDY.config
RESULTS = CONFIG.results
SUBJECTS = list(STUDY.subjects)
OBSERVATION = f"{RESULTS}/cohort/{{subject}}/observation.h5"
FLOW = f"{RESULTS}/{{experiment}}/flow.h5"
EXPERIMENTS = list(CONFIG.experiments_run)
SHARDS = range(CONFIG.resources.shards_per_subject)
PARTS = range(CONFIG.resources.population_parts)
POPULATIONS = list(CONFIG.populations_run)
SHOWN = [
    subject
    for subject in SUBJECTS
    if any(subject in STUDY.subjects_of(name) for name in [*EXPERIMENTS, *POPULATIONS])
]
MAIN = CONFIG.main_experiment
FEATURE_EXPERIMENTS = [
    name for name in EXPERIMENTS if name in CONFIG.feature_experiments
]
SPEED_EXPERIMENTS = [name for name in EXPERIMENTS if name in CONFIG.speed_experiments]
EXACT_TABLES = ["calibration", "alarms"]
EXACT_TABLES += ["identifiability", "information", "design"]
POPULATION_TABLES = [
    "strata",
    "calibration",
    "recovery",
    "recovery_acquisition",
    "alarms",
]
POPULATION_TABLES += ["cohort"]
NONE = "(?!)"  # a pattern that matches no name
FEATURES = "|".join(CONFIG.feature_experiments) or NONE
SPEEDS = "|".join(CONFIG.speed_experiments) or NONE
OVER_POPULATION = "|".join(CONFIG.population_experiments) or NONE
EXACT = "|".join([*CONFIG.speed_experiments, *CONFIG.population_experiments]) or NONE

guard_run(workflow, RESULTS)
config[RUN] = current_run(workflow)
config["figure_captions"] = captions()  # for report/figure.rst


onstart:
    check_dates(
        [
            STUDY.cohort.folder / "subjects.csv",
            *(STUDY.cohort.folder / "swe").glob("*"),
        ]
    )


wildcard_constraints:
    subject="|".join(SUBJECTS),
    experiment="|".join([*CONFIG.experiments, *CONFIG.population_experiments]),
    prior="|".join(CONFIG.priors),
    shard=r"\d+",
    part=r"\d+",


def nulls(wildcards):
    """Return the null recordings among which an experiment is judged, from here: a project may be moved."""
    return os.path.relpath(nulls_of(STUDY, wildcards.experiment))


def stage(name, **fixed):
    """Return the params of a rule that runs a stage, ``package.module:function``.

    ``fixed`` stands for wildcards that the rule does not have.
    """
    return stage_params(
        name, lambda wildcards: View.of_job(STUDY, fixed | wildcards), CONFIG.seed
    )


def reported(
    path,
    caption,
    label,
    category="Experiment {experiment}",
    subcategory="Whole cohort",
):
    """Return a file with its place in the report."""
    return report(
        path,
        caption=f"../report/{caption}.rst",
        category=category,
        subcategory=subcategory if category.startswith("Experiment") else None,
        labels={"result": label},
    )


def drawn(rule, name):
    """Return a rule's figure with its place in the report, which the registry of figures knows."""
    figure = figure_of(rule, name)
    if figure.of == "cohort":
        return reported(
            f"{RESULTS}/figures/{name}.png", "figure", figure.label, category="Cohort"
        )
    if figure.of == "subject":
        path = f"{RESULTS}/{{experiment}}/subjects/{{subject}}/{name}.png"
        return reported(path, "figure", figure.label, subcategory="Subject {subject}")
    path = f"{RESULTS}/figures/{name}-{{experiment}}.png"
    return reported(path, "figure", figure.label, subcategory=figure.subcategory)


def of_subjects(pattern, subjects=SUBJECTS):
    """Return a pattern's paths for these subjects, or all of the cohort; other wildcards are left open."""
    return expand(f"{RESULTS}/{pattern}", subject=subjects, allow_missing=True)


def paths_of(pattern, *experiments):
    """Return a pattern's paths for every subject of each of these experiments."""
    return [
        path
        for name in experiments
        for path in expand(
            f"{RESULTS}/{pattern}", experiment=name, subject=STUDY.subjects_of(name)
        )
    ]


def files_of_subjects(files, experiments):
    """Return these files of every subject of these experiments, subject by subject."""
    return [
        f"{RESULTS}/{name}/subjects/{subject}/{file}"
        for name in experiments
        for subject in STUDY.subjects_of(name)
        for file in files
    ]


def of_experiment(pattern):
    """Return the input function of a pattern's paths for every subject of the wildcard's experiment."""

    def paths(wildcards):
        if not STUDY.subjects_of(wildcards.experiment):
            raise WorkflowError(
                f"the experiment {wildcards.experiment!r} has no subject of the study"
            )
        return paths_of(pattern, wildcards.experiment)

    return paths


def of_its_subject(pattern):
    """Return the input function of one subject's path, refused where the experiment does not have it."""

    def path(wildcards):
        try:
            STUDY.check_subject(wildcards.experiment, wildcards.subject)
        except ConfigError as error:
            raise WorkflowError(str(error)) from None
        return f"{RESULTS}/{pattern}".format(**dict(wildcards.items()))

    return path


def of_those_with_pressures(file):
    """Return a file of every subject whose pressures were taken, in every experiment over a population."""
    return [
        f"{RESULTS}/{experiment}/subjects/{subject}/{file}"
        for experiment in POPULATIONS
        for subject in STUDY.with_pressures(experiment)
    ]


def figures_of_population(experiment):
    """Return the names of the figures of an experiment over a population: of pressures where there are any."""
    names = [*names_of("population"), *names_of("experiment")]
    asked = {
        "pressures": STUDY.with_pressures(experiment),
        "cohort_posterior": STUDY.answered(experiment),
    }
    return [name for name in names if asked.get(name, True)]


def figures_of_populations(*images):
    """Return the figures of all experiments over a population."""
    return [
        f"{RESULTS}/figures/{figure}-{experiment}.{image}"
        for experiment in POPULATIONS
        for figure in figures_of_population(experiment)
        for image in images
    ]


def with_cohort_posterior():
    """Return the experiments with exact posteriors that answer at least one subject."""
    return [*SPEED_EXPERIMENTS, *filter(STUDY.answered, POPULATIONS)]


def cohort_posteriors(*experiments):
    """Return the posterior of the cohort in these experiments, with its tables."""
    return expand(
        f"{RESULTS}/{{experiment}}/{{file}}",
        experiment=[name for name in with_cohort_posterior() if name in experiments],
        file=["cohort_posterior.h5", "cohort_posterior.csv", "cohort_subjects.csv"],
    )


def of_exact(file):
    """Return the input function of a file of every subject with an exact posterior in the wildcard's experiment."""

    def paths(wildcards):
        name = wildcards.experiment
        of_population = name in CONFIG.population_experiments
        subjects = STUDY.answered(name) if of_population else STUDY.subjects_of(name)
        return [
            f"{RESULTS}/{file}".format(experiment=name, subject=subject)
            for subject in subjects
        ]

    return paths


def pressures_tables():
    """Return the table of what pressures add, which there is where any were taken."""
    there = any(map(STUDY.with_pressures, POPULATIONS))
    return [f"{RESULTS}/tables/pressures.csv"] if there else []


def of_answered(file, base=False):
    """Return the input function of a file of every subject that the experiment of the wildcard answers."""

    def paths(wildcards):
        experiment = wildcards.experiment
        folder = CONFIG.base_of(experiment) if base else experiment
        subjects = STUDY.answered(experiment)
        return expand(
            f"{RESULTS}/{folder}/subjects/{{subject}}/{file}", subject=subjects
        )

    return paths


def of_cohort(*experiments):
    """Return the input function of what is shown of every subject in these experiments."""
    folder = "{experiment}/subjects/{subject}"

    def results(wildcards):
        return {
            "predictives": paths_of(f"{folder}/predictive.h5", *experiments),
            "posteriors": paths_of(f"{folder}/posterior.h5", *experiments),
            "verdicts": paths_of(f"{folder}/verdict.json", *experiments),
            "cmaes": list(dict.fromkeys(paths_of("cmaes/{subject}.h5", *experiments))),
        }

    return results


def of_cohort_of_experiment(wildcards):
    """Return what is shown of every subject in the experiment of the wildcard."""
    return of_cohort(wildcards.experiment)(wildcards)


def truth_files():
    """Return the true parameters of a generated cohort; a recorded one has none."""
    path = STUDY.cohort.folder / "truth.csv"
    return [str(path)] if path.is_file() else []


def validation_files():
    """Return the stored table of the validation, where it is to be shown and is there."""
    path = CONFIG.validation_table
    return [path] if path is not None and Path(path).is_file() else []


def noise_files():
    """Return the cohort's noise, which only experiments on speeds need."""
    if not (SPEED_EXPERIMENTS or POPULATIONS):
        return []
    return [f"{RESULTS}/cohort/noise.h5", f"{RESULTS}/cohort/contexts.h5"]


def study_outputs():
    """Return every figure and table of the study, and the page that shows them."""
    return [*(cohort_outputs() if EXPERIMENTS else []), *population_outputs()]


def shown_singly(experiment):
    """Return the subjects whose answers have figures of their own: all of a small cohort, none of a large one."""
    subjects = STUDY.subjects_of(experiment)
    return STUDY.answered(experiment) if len(subjects) <= MOST_SHOWN else ()


def population_outputs():
    """Return figures and tables of the experiments over a population, which need no other experiment."""
    return [
        *expand(
            f"{RESULTS}/{{experiment}}/{{table}}.csv",
            experiment=POPULATIONS,
            table=POPULATION_TABLES,
        ),
        *figures_of_populations("pdf", "png"),
        *cohort_posteriors(*POPULATIONS),
        *pressures_tables(),
        *(
            f"{RESULTS}/{experiment}/agreement.csv"
            for experiment in POPULATIONS
            if CONFIG.base_of(experiment) in EXPERIMENTS and shown_singly(experiment)
        ),
        *(
            f"{RESULTS}/{experiment}/subjects/{subject}/{figure}.png"
            for experiment in POPULATIONS
            for subject in shown_singly(experiment)
            for figure in ("ppc", "posterior")
        ),
    ]


def cohort_outputs():
    """Return figures and tables of the experiments on the cohort, and the pages."""
    return [
        *results_pages(),
        *explorer_page(),
        *expand(
            f"{RESULTS}/figures/{{figure}}.{{image}}",
            figure=names_of("cohort"),
            image=["pdf", "png"],
        ),
        *expand(
            f"{RESULTS}/figures/noise.{{image}}",
            image=["pdf", "png"] if SPEED_EXPERIMENTS else [],
        ),
        *expand(
            f"{RESULTS}/figures/training-{{experiment}}.png", experiment=EXPERIMENTS
        ),
        *expand(
            f"{RESULTS}/tables/{{table}}",
            table=[
                "ppc.csv",
                "ppc.tex",
                "features.csv",
                "posterior.csv",
                "posterior.tex",
                "statements.csv",
                "paper_comparison.csv",
                "paper_comparison.tex",
            ],
        ),
        *(f"{RESULTS}/tables/truth.csv" for _ in truth_files()),
        *expand(
            f"{RESULTS}/figures/{{figure}}-{{experiment}}.{{image}}",
            figure=names_of("speeds"),
            experiment=SPEED_EXPERIMENTS,
            image=["pdf", "png"],
        ),
        *expand(
            f"{RESULTS}/{{experiment}}/{{table}}.csv",
            experiment=SPEED_EXPERIMENTS,
            table=EXACT_TABLES,
        ),
        *cohort_posteriors(*SPEED_EXPERIMENTS),
        *expand(f"{RESULTS}/{{experiment}}/recovery.csv", experiment=EXPERIMENTS),
        *expand(
            f"{RESULTS}/{{experiment}}/recovery_acquisition.csv", experiment=EXPERIMENTS
        ),
        *files_of_subjects(["ppc.png", "posterior.png"], EXPERIMENTS),
    ]


def checks_of_calibration():
    """Return every table of calibration of the experiments with exact posteriors."""
    return [
        *expand(
            f"{RESULTS}/{{experiment}}/{{table}}.csv",
            experiment=SPEED_EXPERIMENTS,
            table=["calibration", "recovery", "recovery_acquisition", "alarms"],
        ),
        *expand(
            f"{RESULTS}/{{experiment}}/{{table}}.csv",
            experiment=POPULATIONS,
            table=["calibration", "strata", "recovery", "recovery_acquisition"]
            + ["alarms", "pushes"],
        ),
    ]


def results_pages():
    """Return the landing page of the results, and those behind it."""
    return [
        f"{RESULTS}/index.html",
        *expand(f"{RESULTS}/report/{{page}}.html", page=FURTHER),
    ]


def explorer_page():
    """Return the page on which the model is moved by hand: of the first experiment on speeds, if there is one."""
    asked = EXPLORER.is_file() and SPEED_EXPERIMENTS
    return [f"{RESULTS}/explorer.html"] if asked else []


def linked_artefacts():
    """Return the results that the landing page leads to, in the order in which it lists them."""
    pages = results_pages()
    shown = [path for path in study_outputs() if path not in pages]
    of_each = ["pool.h5", "training.csv"]
    of_subject = ["verdict.json", "posterior.h5", "predictive.h5"]
    return [
        *explorer_page(),
        *(path for path in shown if path.startswith(f"{RESULTS}/tables/")),
        *(path for path in shown if path.startswith(f"{RESULTS}/figures/")),
        *expand(
            f"{RESULTS}/figures/training-{{experiment}}.pdf", experiment=EXPERIMENTS
        ),
        *expand(
            f"{RESULTS}/{{experiment}}/{{file}}",
            experiment=EXPERIMENTS,
            file=of_each,
        ),
        *expand(
            f"{RESULTS}/{{experiment}}/{{file}}.pt",
            experiment=FEATURE_EXPERIMENTS,
            file=["estimator", "checkpoints"],
        ),
        *expand(
            f"{RESULTS}/{{experiment}}/{{file}}.h5",
            experiment=SPEED_EXPERIMENTS,
            file=["flow", "calibration", "identifiability"],
        ),
        f"{RESULTS}/{MAIN}/epochs.csv",
        *expand(
            f"{RESULTS}/{{experiment}}/{{file}}",
            experiment=POPULATIONS,
            file=["flow.h5", "training.csv", "calibration.h5"],
        ),
        *expand(
            f"{RESULTS}/{{experiment}}/{{file}}-{{part}}.h5",
            experiment=POPULATIONS,
            file=["simulations/shard", "calibration/part"],
            part=PARTS,
        ),
        *(
            f"{RESULTS}/{experiment}/subjects/{subject}/{file}"
            for experiment in POPULATIONS
            for subject in shown_singly(experiment)
            for file in of_subject
        ),
        *of_those_with_pressures("with_pressures.h5"),
        *files_of_subjects(of_subject, EXPERIMENTS),
        *files_of_subjects(
            ["calibration_recordings.h5", "calibration_local.h5"],
            SPEED_EXPERIMENTS,
        ),
        *shown,
        *expand(
            f"{RESULTS}/cohort/{{subject}}/{{file}}.h5",
            subject=SHOWN,
            file=["observation", "passive"],
        ),
        *noise_files(),
        *of_subjects("cmaes/{subject}.h5", SHOWN),
        *dict.fromkeys(
            path
            for experiment in EXPERIMENTS
            for path in shards_of(experiment, STUDY.subjects_of(experiment))
        ),
    ]


def shards_of(experiment, subjects):
    """Return the shards of these subjects under an experiment's prior."""
    return expand(
        f"{RESULTS}/simulations/{{prior}}/{{subject}}/shard-{{shard}}.h5",
        prior=CONFIG.experiments[experiment].prior,
        subject=subjects,
        shard=SHARDS,
    )


def shards_of_subject(wildcards):
    """Return the shards of one subject under the experiment's prior."""
    return shards_of(wildcards.experiment, [wildcards.subject])


def shards_of_experiment(wildcards):
    """Return the shards of every subject of the wildcard's experiment."""
    return shards_of(wildcards.experiment, STUDY.subjects_of(wildcards.experiment))
