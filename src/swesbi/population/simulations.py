"""Simulations over a population: contexts drawn from it, and draws of the prior of theta in each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swesbi import artefacts
from swesbi.base.arrays import FloatArray, IntArray
from swesbi.base.progress import Progress
from swesbi.context import Context
from swesbi.heart.prior_simulations import LABELS, draw_simulations
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.measurement.speeds import wall_at_phases
from swesbi.parameters import NUISANCE_COLUMNS, THETA_COLUMNS
from swesbi.population.contexts import draw_contexts
from swesbi.population.settings import PopulationSettings
from swesbi.recording.observation import context_values, contexts_of
from swesbi.recording.phases import nominal_phases

ALONG: Final = "context"


@dataclass(frozen=True)
class PopulationSimulations:
    """m contexts with d draws of theta each, at the P nominal phases."""

    contexts: tuple[Context, ...]
    theta: Annotated[FloatArray, artefacts.Variable("context draw parameter", THETA_COLUMNS, "prior draws")]
    physiology: Annotated[
        FloatArray,
        artefacts.Variable("context draw nuisance", NUISANCE_COLUMNS, "free physiology of the simulation"),
    ]
    nuisance_names: Annotated[tuple[str, ...], artefacts.Labels("nuisance")]
    active_stiffness_kpa: Annotated[
        FloatArray, artefacts.Variable("context draw phase", "kPa", "active stiffness at the nominal phases")
    ]
    active_slope_kpa: Annotated[
        FloatArray, artefacts.Variable("context draw phase", "kPa", "its slope, per (unitless) cycle")
    ]
    shortening: Annotated[
        FloatArray, artefacts.Variable("context draw phase", "1", "shortening of the wall, 0 to 1")
    ]
    shortening_slope: Annotated[
        FloatArray, artefacts.Variable("context draw phase", "1", "its slope, per (unitless) cycle")
    ]
    failures: Annotated[
        IntArray,
        artefacts.Variable("context status", "1", "failed simulations by status, drawn again"),
    ]


def simulate_population(
    index: Sequence[int],
    draws: int,
    population: PopulationSettings,
    phases: int,
    model: SpeedModelSettings,
    seed: int,
    label: str = "population",
) -> PopulationSimulations:
    """Simulate the numbered contexts of the training set.

    Each context, and each draw in it, has a random stream of its own, so neither shards nor cores matter.

    Args:
        index: Numbers of the contexts.
        draws: Draws of theta in each.
        population: From which contexts are drawn.
        phases: Nominal phases.
        model: Prior, forward model and passive law.
        seed: The study's seed.
        label: Name in progress lines.

    Raises:
        SimulationFailure: A draw failed too often.
    """
    contexts = draw_contexts(index, population, seed, "training", broad=True)
    progress = Progress(label, len(contexts), unit="context")
    parts = []
    for context in contexts:
        parts.append(_simulate(context, draws, nominal_phases(phases), model, seed))
        progress.step()
    theta, physiology, *others = (np.stack(column) for column in zip(*parts, strict=True))
    names = model.prior.theta.physiology_names
    return PopulationSimulations(contexts, theta, physiology, names, *others)


def _simulate(
    context: Context, draws: int, phase: FloatArray, model: SpeedModelSettings, seed: int
) -> tuple[NDArray[np.generic], ...]:
    made = draw_simulations(range(draws), context, model.prior.theta, model.forward_model, seed)
    wall = wall_at_phases(made, phase, model.measurement.active_stiffness_map)
    return (made.theta, made.physiology, *vars(wall).values(), made.failures.sum(axis=0))


SCHEMA: Final = artefacts.schema_of(Context, ALONG)["/"] | artefacts.schema_of(PopulationSimulations)["/"]
KIND: Final = artefacts.register(
    "population_simulations", {"/": SCHEMA}, (*LABELS, "nuisance", artefacts.Labels(ALONG, "subject"))
)


def to_dataset(made: PopulationSimulations) -> xr.Dataset:
    """Return the simulations as a dataset with dimensions context, draw and phase."""
    labels = {
        **LABELS,
        "subject": (ALONG, [context.subject for context in made.contexts]),
        "nuisance": list(made.nuisance_names),
    }
    values = artefacts.values_of(made)["/"] | context_values(made.contexts)
    return artefacts.build_dataset(SCHEMA, values, labels)


def read_population(shards: Sequence[Path]) -> PopulationSimulations:
    """Read the shards of the training set, in the order of the contexts whatever the order of the files.

    Raises:
        ArtefactError: A file is no such shard.
    """
    merged = xr.concat([artefacts.load(path, KIND)[0] for path in shards], dim="context").sortby("subject")
    rebuilt = artefacts.from_dataset(PopulationSimulations, merged, contexts=contexts_of(merged, ALONG))
    arrays: dict[str, Any] = {
        name: np.ascontiguousarray(value) for name, value in artefacts.values_of(rebuilt)["/"].items()
    }
    return replace(rebuilt, **arrays)
