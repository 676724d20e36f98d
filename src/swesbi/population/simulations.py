"""Simulations over a population: contexts drawn from it, and draws of the prior of theta in each."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray

from swesbi import artefacts
from swesbi.artefacts.schema import Schema
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

LOGGER = logging.getLogger("swesbi")
ALONG: Final = "context"


@dataclass(frozen=True)
class PopulationSimulations(artefacts.Artefact, kind="population_simulations"):
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

    labels = LABELS

    @classmethod
    def schema(cls) -> Schema:
        """Return the one group of the file: contexts, and their simulations."""
        return {"/": SCHEMA}

    @classmethod
    def required_labels(cls) -> tuple[artefacts.Labels, ...]:
        """Return the names of contexts beside those of the fields."""
        return *super().required_labels(), artefacts.Labels(ALONG, "subject")

    def to_groups(self) -> dict[str, artefacts.Group]:
        """Return the content of the file, with dimensions context, draw and phase."""
        labels = {
            **LABELS,
            "subject": (ALONG, [context.subject for context in self.contexts]),
            "nuisance": list(self.nuisance_names),
        }
        values = artefacts.values_of(self)["/"] | context_values(self.contexts)
        return {"/": artefacts.build_group(SCHEMA, values, labels)}

    @classmethod
    def rebuilt(
        cls, groups: Mapping[str, artefacts.Group], made: artefacts.Provenance
    ) -> PopulationSimulations:
        """Return what the group of a file holds."""
        return artefacts.from_groups(cls, groups, {"contexts": contexts_of(groups["/"], ALONG)})

    @classmethod
    def joined(cls, parts: Sequence[PopulationSimulations]) -> PopulationSimulations:
        """Return the shards together, in the order of the contexts whatever that of the files."""
        contexts = [context for part in parts for context in part.contexts]
        order = sorted(range(len(contexts)), key=lambda index: contexts[index].subject)
        arrays: dict[str, Any] = {
            name: np.concatenate([getattr(part, name) for part in parts])[order]
            for name in artefacts.schema_of(cls)["/"]
        }
        return replace(parts[0], contexts=tuple(contexts[index] for index in order), **arrays)


def shard_of_population(
    *,
    context_numbers: tuple[int, int],
    draws_per_context: int,
    phases: int,
    population: PopulationSettings,
    model: SpeedModelSettings,
    experiment: str,
    seed: int,
) -> PopulationSimulations:
    """Simulate the contexts of the training set from the first number to before the second.

    Each context, and each draw in it, has a random stream of its own, so neither shards nor cores matter.
    """
    first, stop = context_numbers
    contexts = draw_contexts(range(first, stop), population, seed, "training", broad=True)
    label = f"simulations {experiment}, contexts {first} to {stop - 1}"
    progress = Progress(label, len(contexts), unit="context")
    parts = []
    for context in contexts:
        parts.append(_simulate(context, draws_per_context, nominal_phases(phases), model, seed))
        progress.step()
    theta, physiology, *others = (np.stack(column) for column in zip(*parts, strict=True))
    names = model.prior.theta.physiology_names
    made = PopulationSimulations(contexts, theta, physiology, names, *others)
    failed, drawn = int(made.failures.sum()), len(contexts) * draws_per_context
    LOGGER.info("%d contexts, %d simulations, %d failed and drawn again", len(contexts), drawn, failed)
    return made


def _simulate(
    context: Context, draws: int, phase: FloatArray, model: SpeedModelSettings, seed: int
) -> tuple[NDArray[np.generic], ...]:
    made = draw_simulations(range(draws), context, model.prior.theta, model.forward_model, seed)
    wall = wall_at_phases(made, phase, model.measurement.active_stiffness_map)
    return (made.theta, made.physiology, *vars(wall).values(), made.failures.sum(axis=0))


SCHEMA: Final = artefacts.schema_of(Context, ALONG)["/"] | artefacts.schema_of(PopulationSimulations)["/"]
