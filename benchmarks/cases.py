"""What benchmark and figures of the forward model run on: shipped settings, prior, A to F."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swesbi.config.read import parse_config, read_merged
from swesbi.context import Context
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import Beats, simulate
from swesbi.prior import PriorSettings, quantile
from swesbi.recording.cohort.subjects import read_subjects
from swesbi.seeds import generator

Array = NDArray[np.float64]

ROOT = Path(__file__).parents[1]
CONVERGED = {"steps_per_beat": 6400, "periodicity_tolerance": 1e-10, "maximum_beats": 300}


@dataclass(frozen=True)
class Cases:
    """The subjects and the prior draws that every subject gets."""

    settings: ForwardModelSettings
    contexts: tuple[Context, ...]
    theta: Array


def load_cases(draws: int, config: Path = ROOT / "config.yaml") -> Cases:
    """Read settings and prior of the study's configuration, and the main experiment's subjects."""
    study = parse_config(read_merged(config), str(config))
    prior: PriorSettings = study.priors["paper"]
    u = generator(study.seed, "simulator benchmark").uniform(size=(draws, 3))
    listed = study.listed_subjects(study.main_experiment)
    cohort = read_subjects(ROOT / "data" / "virtual_volunteers" / "subjects.csv")
    contexts = tuple(context for context in cohort if listed is None or context.subject in listed)
    return Cases(study.forward_model, contexts, quantile(u, prior))


def with_numerics(settings: ForwardModelSettings, **values: object) -> ForwardModelSettings:
    """Return the settings with other numerics, validated."""
    return ForwardModelSettings.from_plain(settings.to_plain() | values)


def converged_beats(cases: Cases) -> list[Beats]:
    """Return the periodic beats at 6400 steps and a relative change of 1e-10 a beat."""
    exact = with_numerics(cases.settings, **CONVERGED)
    return [simulate(cases.theta, context, exact) for context in cases.contexts]


def stiffness_errors(beats: Beats, exact: Beats) -> Array:
    """Return the largest error (n,) of k_c over the beat, relative to its peak, on the points of `beats`."""
    every = exact.cycle_phase.size // beats.cycle_phase.size
    reference = exact.active_stiffness_kpa[:, ::every]
    error: Array = np.abs(beats.active_stiffness_kpa - reference).max(axis=1) / reference.max(axis=1)
    return error
