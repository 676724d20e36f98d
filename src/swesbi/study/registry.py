"""Every stage of the study: which module holds its function, and what it is for.

Light: the workflow and the command line read it before anything heavy is imported.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from types import MappingProxyType
from typing import Any, Final, get_type_hints

from swesbi.code_hash import stage_hash

_MODULES: Final[Mapping[str, Mapping[str, str]]] = {
    "cohort": {
        "ingest": "the raw recording of one subject becomes its observed curve.",
        "ingest_batch": "the raw recordings of a batch of subjects become their observed curves.",
        "noise": "the variance components of the measured speeds, from the whole cohort.",
        "passive": "the passive baseline of one subject, calibrated in late diastole along a reference beat.",
    },
    "simulation": {
        "simulate": "one shard of successful simulations from the prior, for one subject.",
        "population_simulate": "one shard of the simulations over a population.",
        "pool": "the pooled training set of one experiment.",
        "speed_pool": "the training set of an experiment on measured speeds.",
    },
    "training": {
        "train": "training the density estimator of one experiment.",
    },
    "flow_training": {
        "train_flow": "training the flow of an experiment on measured speeds.",
        "train_population": "training one flow for every context of a population.",
    },
    "inference": {
        "posterior": "prior support and posterior of one subject.",
        "recovery": "recovery of known parameters under the experiment's own observation model.",
        "recovery_acquisition": "recovery of known parameters from recordings with acquisition noise.",
    },
    "epochs": {
        "epochs": "how recovery, posteriors and predictions evolve with the epochs of training.",
    },
    "acquisition_seeds": {
        "acquisition_seeds": "the virtual volunteers under other acquisition seeds, by a trained network.",
    },
    "predictive": {
        "predictive": "the prior and posterior predictive checks of one subject.",
        "predictive_speeds": "the predictive checks of one subject in an experiment on speeds.",
    },
    "cmaes": {
        "cmaes": "the CMA-ES reference fit of one subject.",
    },
    "exact": {
        "exact_posterior": "the exact posterior of one subject in an experiment on speeds.",
        "sensitivity_run": "the exact posteriors of the cohort under one variant of the configuration.",
        "calibration_recordings": "recordings of known parameters, inferred by the network and exactly.",
    },
    "two_samples": {
        "calibration_local": "calibration at one subject's own data, and its samplers beside long chains.",
        "population_agreement": "whether a population's network and the cohort's give the same posteriors.",
    },
    "calibration": {
        "calibration": "every check of calibration over the whole cohort, and coverage of known parameters.",
    },
    "misspecification": {
        "misspecification": "null distributions of one subject's misspecification tests.",
        "population_null": "nulls of the misspecification tests over a population.",
    },
    "verdict": {
        "verdict": "the verdict on one subject of an experiment on measured speeds.",
        "misspecification_table": "how often the misspecification tests raise an alarm, on what.",
    },
    "population": {
        "population_calibration": "a part of the recordings of fresh contexts, inferred by both samplers.",
        "population_scores": "calibration on fresh contexts, judged over all of them and by stratum.",
    },
    "answers": {
        "population_answers": "the answers for a batch of subjects by the network of a population.",
    },
    "identifiability": {
        "identifiability": "what the recordings can tell about the parameters, and what others would.",
        "identifiability_figures": "the figures of the study of identifiability.",
    },
    "sensitivity": {
        "discrepancy": "each pair (delta, tau) of a grid, on a cohort with known model error.",
        "sensitivity": "the table and the figure of what each variant changes.",
    },
    "new_subject": {
        "new_subject": "a subject outside the pool, answered by the trained network as it is.",
        "new_subject_of_population": "a subject outside the study, answered by the network of a population.",
    },
    "subject_figures": {
        "subject_figures": "the figures of one subject, predictive check and posterior.",
        "exact_subject_figures": "the figures of one subject: predictive check and exact posterior.",
        "cohort_figures": "figures 2 and 3: predictive checks and posteriors of a whole cohort.",
        "exact_figures": "predictive checks and exact posteriors of a whole cohort.",
    },
    "study_figures": {
        "workflow_figure": "figure 1, the workflow drawn from the results of one subject.",
        "experiments_figure": "the experiments beside each other, subject by subject.",
        "training_figure": "training and validation loss of an experiment's estimator, epoch by epoch.",
        "epochs_figure": "loss, recovery, observed coverage and posterior width against the epoch.",
    },
    "check_figures": {
        "noise_figure": "the figure of the variance components, of each recording and of the cohort.",
        "misspecification_figure": "the misspecification tests: p-values, verdicts, false alarms, power.",
        "calibration_figure": "the figure of an experiment's calibration.",
        "population_cohort": "every subject of a cohort as a population's network answers it.",
        "strata_figure": "the figure of calibration by stratum of an experiment over a population.",
    },
    "tables": {
        "tables": "the tables of every experiment, as CSV and LaTeX.",
        "truth": "credible intervals beside the parameters that made the recordings.",
        "paper_comparison": "every number of the paper beside this study's, as CSV and LaTeX.",
    },
    "report": {
        "report": "the landing page of the results, readable without the workflow.",
    },
}
"""Stages of each module of ``swesbi.study.stages``, with a line on each; a function has its stage's name."""
STAGES: Final[Mapping[str, str]] = MappingProxyType(
    {name: line for lines in _MODULES.values() for name, line in lines.items()}
)
"""What each stage is for."""
_MODULE_OF: Final = {
    name: f"swesbi.study.stages.{module}" for module, lines in _MODULES.items() for name in lines
}


FILES: Final = "files"
"""The argument of a stage, if it has one, that is a dataclass of files."""
_NO_FILES: Final = (FILES, "settings", "origin", "return")


def stage_function(name: str) -> Callable[..., None]:
    """Return the function of a stage; its module is imported now, with all that the stage needs.

    Raises:
        KeyError: There is no such stage.
    """
    function: Callable[..., None] = getattr(import_module(_MODULE_OF[name]), name)
    return function


def file_types(run: Callable[..., None]) -> dict[str, Any]:
    """Return the types of a stage's files by name: of its own arguments and of the fields of ``files``."""
    hints = get_type_hints(run)
    group = get_type_hints(hints[FILES]) if FILES in hints else {}
    return {name: hint for name, hint in hints.items() if name not in _NO_FILES} | group


def file_arguments(run: Callable[..., None], files: Mapping[str, Any]) -> dict[str, Any]:
    """Return a stage's files as its arguments: those of the group ``files`` together, if it has one."""
    hints = get_type_hints(run)
    arguments = {name: file for name, file in files.items() if name in hints}
    if FILES in hints:
        arguments[FILES] = hints[FILES](**{name: files[name] for name in get_type_hints(hints[FILES])})
    return arguments


def stage_place(name: str) -> tuple[str, str]:
    """Return the module and the name of the function of a stage.

    Raises:
        KeyError: There is no such stage.
    """
    return _MODULE_OF[name], name


def stage_code(name: str) -> str:
    """Return the hash of the code that a stage runs.

    Raises:
        KeyError: There is no such stage.
    """
    return stage_hash(*stage_place(name))
