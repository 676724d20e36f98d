"""The validated study, and what is taken from it everywhere: paths, subjects, params of the stages."""

import os
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
from swesbi.config.view import View, nulls_of
from swesbi.report.figures.registry import WHOLE, captions, figure_of
from swesbi.study.running import RUN, check_dates, current_run, guard_run
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
OBSERVATION = "<results>/cohort/{subject}/observation.h5"
PASSIVE = "<results>/cohort/{subject}/passive.h5"
NOISE = "<results>/cohort/noise.h5"
CMAES = "<results>/cmaes/{subject}.h5"
FLOW = "<results>/{experiment}/flow.h5"
POSTERIOR = "<results>/{experiment}/subjects/{subject}/posterior.h5"
VERDICT = "<results>/{experiment}/subjects/{subject}/verdict.json"
PREDICTIVE = "<results>/{experiment}/subjects/{subject}/predictive.h5"
EXPERIMENTS = list(CONFIG.experiments_run)
PARTS = range(CONFIG.resources.population_parts)
POPULATIONS = list(CONFIG.populations_run)
SHOWN = [
    subject
    for subject in SUBJECTS
    if any(subject in STUDY.subjects_of(name) for name in [*EXPERIMENTS, *POPULATIONS])
]
# of a generated cohort; a recorded one has none
TRUTH_FILES = [str(path) for path in STUDY.cohort.folder.glob("truth.csv")]
MAIN = CONFIG.main_experiment
FEATURE_EXPERIMENTS = [name for name in EXPERIMENTS if name in CONFIG.feature_experiments]
SPEED_EXPERIMENTS = [name for name in EXPERIMENTS if name in CONFIG.speed_experiments]
NONE = "(?!)"  # a pattern that matches no name
FEATURES = "|".join(CONFIG.feature_experiments) or NONE
SPEEDS = "|".join(CONFIG.speed_experiments) or NONE
OVER_POPULATION = "|".join(CONFIG.population_experiments) or NONE
PRESSURED = [subject for subject in SUBJECTS if STUDY.has_pressures(subject)]
WITH_PRESSURES = "|".join(PRESSURED) or NONE
WITHOUT_PRESSURES = "|".join(subject for subject in SUBJECTS if subject not in PRESSURED) or NONE
EXACT = "|".join([*CONFIG.speed_experiments, *CONFIG.population_experiments]) or NONE


pathvars:
    results=RESULTS,


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


# what the pages print is long: a param each section, so that a dry run prints those that have changed
SECTIONS = {
    name: list(View(STUDY, {})[name]) for name in ["configuration", "experiments_shown", "populations_shown"]
}


def stage(name, **fixed):
    """Return the params of the jobs of a stage.

    ``name`` is ``package.module:function``; ``fixed`` stands for wildcards that its jobs do not have.
    """
    return stage_params(
        name,
        lambda wildcards: View.of_job(STUDY, fixed | wildcards),
        CONFIG.seed,
        SECTIONS,
    )


# categories of the report by what lies in the folder of results and is of no experiment
OF_THE_STUDY = {
    "figures": "Cohort",
    "tables": "Tables",
    "configuration.yaml": "Configuration",
}


def reported(path, caption, label, subcategory="Whole cohort"):
    """Return a file with its place in the report, which follows from its path.

    ``subcategory`` is that of an experiment's file that is of no subject.
    """
    category = "Experiment {experiment}"
    if "{subject}" in path:
        subcategory = "Subject {subject}"
    elif "{experiment}" not in path:
        category, subcategory = OF_THE_STUDY[path.split("/")[1]], None
    return report(
        path,
        caption=f"../report/{caption}.rst",
        category=category,
        subcategory=subcategory,
        labels={"result": label},
    )


def drawn(rule, name):
    """Return a rule's figure with its place in the report, which the registry of figures knows."""
    figure = figure_of(rule, name)
    if figure.of in WHOLE:
        path = f"<results>/figures/{name}.png"
    elif figure.of == "subject":
        path = f"<results>/{{experiment}}/subjects/{{subject}}/{name}.png"
    else:
        path = f"<results>/figures/{name}-{{experiment}}.png"
    return reported(path, "figure", figure.label, figure.subcategory)


def paths_of(pattern, *experiments, subjects=STUDY.answered, **others):
    """Return a pattern's paths, each once, for every subject that each of these experiments answers.

    ``subjects`` gives other subjects of an experiment, ``others`` stand for further wildcards.
    """
    paths = {}
    for name in experiments:
        found = expand(pattern, experiment=name, subject=subjects(name), **others)
        paths |= dict.fromkeys(found)
    return list(paths)


def of_experiment(pattern):
    """Return the input function of a pattern's paths for every subject of the wildcard's experiment."""

    def paths(wildcards):
        if not STUDY.subjects_of(wildcards.experiment):
            raise WorkflowError(f"the experiment {wildcards.experiment!r} has no subject of the study")
        return paths_of(pattern, wildcards.experiment)

    return paths


def of_its_subject(pattern):
    """Return the input function of one subject's path, refused where the experiment does not have it."""

    def path(wildcards):
        try:
            STUDY.check_subject(wildcards.experiment, wildcards.subject)
        except ConfigError as error:
            raise WorkflowError(str(error)) from None
        return pattern.format(**dict(wildcards.items()))

    return path


def shown_of(*experiments):
    """Return what is shown of every subject in these experiments."""
    return {
        "predictives": paths_of(PREDICTIVE, *experiments),
        "posteriors": paths_of(POSTERIOR, *experiments),
        "verdicts": paths_of(VERDICT, *experiments),
        "cmaes": paths_of(CMAES, *experiments),
    }


def shards_of(experiment, subjects):
    """Return the shards of these subjects under an experiment's prior."""
    return expand(
        "<results>/simulations/{prior}/{subject}/shard-{shard}.h5",
        prior=CONFIG.experiments[experiment].prior,
        subject=subjects,
        shard=range(CONFIG.resources.shards_per_subject),
    )
