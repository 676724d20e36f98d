"""Training one flow for every context of a population; all but theta is drawn anew each epoch."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.measurement.likelihood import SpeedModelSettings, draw_speeds
from swesbi.measurement.speeds import WallPhases
from swesbi.networks.files import fit_standardisation
from swesbi.networks.flow.conditioning import (
    CellConditioner,
    CellSettings,
    SeenCells,
    cell_inputs,
    context_inputs,
)
from swesbi.networks.flow.training import FlowParts, Rows, TrainedWithLosses, fit_flow, single
from swesbi.networks.settings import FlowSettings
from swesbi.population.conditions import draw_cells
from swesbi.population.settings import ConditionSettings
from swesbi.population.simulations import PopulationSimulations
from swesbi.prior import sample, to_logit
from swesbi.recording.settings import AcquisitionSettings, RecordingSettings
from swesbi.seeds import generator, integer_seed

CONTEXTS_AT_A_TIME: Final = 500  # what is made on the way to their rows takes a hundred megabytes


@dataclass(frozen=True)
class RowMaker:
    """Turns simulations into training rows; the seed is of everything that is drawn."""

    model: SpeedModelSettings
    conditions: ConditionSettings
    acquisition: AcquisitionSettings
    recording: RecordingSettings
    cells: CellSettings
    seed: int

    def raw(self, made: PopulationSimulations, *name: str | int) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Draw all but the simulation for each of them: eta (n, d) and inputs (n, C), of some at a time."""
        rng = generator(self.seed, "population rows", *name)
        for start in range(0, len(made.contexts), CONTEXTS_AT_A_TIME):
            yield self._raw(_part(made, slice(start, start + CONTEXTS_AT_A_TIME)), rng)

    def _raw(self, made: PopulationSimulations, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        theta, physiology, prior = _flat(made.theta), _flat(made.physiology), self.model.prior
        phi = prior.joined(theta, physiology, sample(len(theta), prior.operator, rng))
        drawn = draw_cells(len(theta), self.conditions, self.acquisition, self.recording, rng)
        taken = (made.active_stiffness_kpa, made.active_slope_kpa, made.shortening, made.shortening_slope)
        wall = WallPhases(*map(_flat, taken)).between(drawn.offset)
        predicted = self.model.predict(phi, wall)
        speeds = draw_speeds(predicted, drawn.errors, self.model.discrepancy, rng)
        seen = SeenCells(np.log(speeds), drawn.measured, drawn.relative_se, drawn.offset, drawn.errors_log_sd)
        context = np.stack([context_inputs(context) for context in made.contexts]).repeat(
            made.theta.shape[1], axis=0
        )
        return to_logit(prior.heart(phi), prior.simulated), cell_inputs(context, seen, self.cells)


def split_by_context(
    made: PopulationSimulations, held_out_fraction: float
) -> tuple[PopulationSimulations, PopulationSimulations]:
    """Split into training and held-out contexts, the last ones held out: a network must know new hearts."""
    number = len(made.contexts)
    edge = number - round(held_out_fraction * number)
    if not 0 < edge < number:
        raise ValueError(
            f"{number} contexts cannot be split with validation_fraction = {held_out_fraction}; "
            "simulate more or change the fraction"
        )
    return _part(made, slice(0, edge)), _part(made, slice(edge, number))


def _part(made: PopulationSimulations, rows: slice) -> PopulationSimulations:
    parts = {name: value[rows] for name, value in vars(made).items() if name != "nuisance_names"}
    return replace(made, **parts)


def _flat(values: FloatArray) -> FloatArray:
    return values.reshape(math.prod(values.shape[:-1]), values.shape[-1])  # -1 cannot stand for no columns


def train_population(
    made: PopulationSimulations, maker: RowMaker, settings: FlowSettings, label: str = "training"
) -> TrainedWithLosses:
    """Fit q(heart | z) on simulations over a population, recordings drawn anew every epoch.

    Contexts are split into training and held-out ones; standardisation comes from the training ones; the
    weights of the best epoch on the held-out ones are kept. Runs on one thread and repeats exactly.
    """
    training, held_out = split_by_context(made, settings.validation_fraction)
    raw_eta, inputs = map(np.concatenate, zip(*maker.raw(training, "statistics"), strict=True))
    eta, conditioner = fit_standardisation(raw_eta), CellConditioner(maker.cells, fit_standardisation(inputs))
    del raw_eta, inputs

    def rows_of(part: PopulationSimulations, name: str, number: int) -> Rows:
        """Draw one epoch's rows, standardised; the stream depends on the seed, the name and the number."""
        parts = [
            (single(eta.apply(raw_eta)), single(conditioner.standardise(inputs)))
            for raw_eta, inputs in maker.raw(part, name, number)
        ]
        return Rows(*map(np.concatenate, zip(*parts, strict=True)))

    parts = FlowParts(conditioner, eta, maker.model.prior.simulated)
    return fit_flow(training, held_out, rows_of, parts, settings, maker.seed, label)


def trained_over_population(
    shards: PopulationSimulations,
    *,
    model: SpeedModelSettings,
    conditions: ConditionSettings,
    acquisition: AcquisitionSettings,
    recording: RecordingSettings,
    estimator: FlowSettings,
    experiment: str,
    seed: int,
) -> TrainedWithLosses:
    """Train q(heart | z) on recordings drawn over the population.

    Runs on the CPU, on one thread, and repeats exactly.
    """
    maker = RowMaker(
        model=model,
        conditions=conditions,
        acquisition=acquisition,
        recording=recording,
        cells=CellSettings(cells=acquisition.phases, relative_se=conditions.seen_relative_se),
        seed=integer_seed(seed, "population training"),
    )
    return train_population(shards, maker, estimator, f"training {experiment}")
