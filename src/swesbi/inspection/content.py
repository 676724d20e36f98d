"""What a file of the study holds, whatever its format: arrays, and what else it says by key, in sections."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from numpy.typing import NDArray

ORIGIN: Final = "made by"
SETTINGS: Final = "settings"
FACTS: Final = "says"

KINDS: Final = {
    "observation": "observed stiffness curve of one subject, from its recording",
    "contexts": "contexts of the subjects of a cohort",
    "passive": "passive baseline of one subject",
    "simulations": "simulations from a prior, one shard of one subject",
    "pool": "pooled training set of an experiment on features",
    "speed_pool": "training set of an experiment on measured speeds",
    "population_simulations": "simulations over a population, one shard",
    "population_calibration": "recordings of fresh contexts of a population, inferred",
    "population_null": "well-specified recordings of a population, for the tests of its subjects",
    "posterior": "posterior of one subject in one experiment",
    "exact_posterior": "exact posterior of one subject, the network's beside it",
    "predictive": "prior and posterior predictive checks of one subject",
    "noise": "noise of the measured speeds of a cohort",
    "sensitivity": "posteriors under one variant of the configuration",
    "calibration_recordings": "recordings of known parameters in one subject's context, inferred",
    "calibration_local": "calibration at one subject's own data",
    "calibration": "recordings of known parameters, and what each sampler made of them",
    "identifiability": "posterior and likelihood-ratio intervals of every subject",
    "misspecification": "whether the model can have made the recordings",
    "cmaes": "CMA-ES reference fit of one subject",
    "estimator": "trained network of an experiment, weights of the best epoch",
    "flow": "trained flow of an experiment on measured speeds",
    "checkpoints": "weights of one training after selected epochs",
}

FILES: Final = {
    "support.json": "verdict on the prior support of one subject",
    "training.csv": "losses of a training by epoch",
    "epochs.csv": "recovery and posteriors by epoch of training",
    "recovery.csv": "recovery of known parameters, the experiment's own observation model",
    "recovery_acquisition.csv": "recovery of known parameters from synthetic recordings",
    "strata.csv": "coverage of credible intervals on fresh contexts, by stratum",
    "agreement.csv": "posteriors by a population's network beside those by the cohort's",
    "cohort.csv": "every subject as a population's network answers or refuses it",
    "ppc.csv": "table 1: predictive scores of every subject and experiment",
    "features.csv": "checked features of every subject and experiment",
    "posterior.csv": "posterior medians, intervals and correlations",
    "paper_comparison.csv": "every number of the paper beside this study's",
    "acquisition_seeds.csv": "virtual volunteers under other acquisition seeds",
    "acquisition_seeds_medians.csv": "medians over acquisition seeds",
    "configuration.yaml": "every choice of a run, merged configuration",
    "subjects.csv": "the subjects of a cohort",
    "recording.yaml": "how the recordings of a cohort were made",
}


@dataclass(frozen=True)
class Array:
    """One array: ``values`` of numbers or text, along named dimensions."""

    name: str
    dims: tuple[str, ...]
    values: NDArray[Any]
    units: str = ""
    meaning: str = ""

    @property
    def is_numeric(self) -> bool:
        """Whether the values are numbers."""
        return self.values.dtype.kind in "biuf"


@dataclass(frozen=True)
class Content:
    """One file.

    Attributes:
        path: The file.
        what: What it is, in a few words.
        sections: What it says, text by key: ``ORIGIN`` (version, code hash, seed, subject), the ``SETTINGS``
            behind it, their nested keys joined by dots, and other ``FACTS``.
        arrays: Its arrays.
        integrity: What its checksum says; empty where the format has none.
    """

    path: Path
    what: str
    sections: Mapping[str, Mapping[str, str]]
    arrays: tuple[Array, ...] = ()
    integrity: str = ""


def flatten(plain: object, key: str = "") -> dict[str, str]:
    """Return nested plain data as text by key: ``{"prior": {"low": 2}}`` becomes ``{"prior.low": "2"}``."""
    return dict(_leaves(plain, key))


def _leaves(plain: object, key: str) -> Iterator[tuple[str, str]]:
    if isinstance(plain, dict):
        for name, value in plain.items():
            yield from _leaves(value, f"{key}.{name}" if key else str(name))
    elif isinstance(plain, list) and any(isinstance(item, dict | list) for item in plain):
        for index, value in enumerate(plain):
            yield from _leaves(value, f"{key}[{index}]")
    elif isinstance(plain, list | tuple):
        yield key, ", ".join(map(str, plain))
    else:
        yield key, str(plain)
