"""The rows of one epoch over a population: the same theta, everything else about a recording drawn anew."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.flow.epochs import Rows
from swesbi.flow.phases import PhaseConditioner, PhaseSettings, context_inputs, phase_inputs
from swesbi.inference.standardisation import Standardisation
from swesbi.population.conditions import draw_conditions
from swesbi.population.settings import ConditionSettings
from swesbi.population.simulations import PopulationSimulations
from swesbi.prior import draw_passive_scale, to_logit
from swesbi.recording.settings import RecordingSettings
from swesbi.seeds import generator
from swesbi.speed_model.likelihood import draw_speeds
from swesbi.speed_model.model import SpeedModelSettings
from swesbi.speed_model.prediction import ActivePhases, combine
from swesbi.virtual_cohort.settings import AcquisitionSettings

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class RowMaker:
    """Turns simulations into training rows.

    Attributes:
        model: Prior, discrepancy and density.
        conditions: Noise levels and missing phases.
        protocol: Repeats, samples and failures behind the standard errors.
        recording: What ingestion admits.
        phases: What the network sees.
        seed: Of everything that is drawn.
    """

    model: SpeedModelSettings
    conditions: ConditionSettings
    protocol: AcquisitionSettings
    recording: RecordingSettings
    phases: PhaseSettings
    seed: int

    def raw(self, made: PopulationSimulations, *name: str | int) -> tuple[FloatArray, FloatArray]:
        """Draw scale, conditions and noise for every simulation: eta (n, 4) and inputs (n, C)."""
        rng = generator(self.seed, "population rows", *name)
        contexts, draws, _ = made.theta.shape
        theta, g, g_slope = _flat(made.theta), *(_each(x, draws) for x in _passive(made))
        scale = draw_passive_scale(len(theta), self.model.prior, rng)
        active = ActivePhases(_flat(made.active_stiffness_kpa), _flat(made.active_slope_kpa))
        predicted = combine(scale, active, g, g_slope, self.model.density_kg_m3)
        drawn = draw_conditions(len(theta), self.conditions, self.protocol, self.recording, rng)
        speeds = draw_speeds(predicted, drawn.relative_se, self.model.discrepancy, rng)
        context = _each(np.stack([context_inputs(one) for one in made.contexts]), draws)
        inputs = phase_inputs(context, np.log(speeds), drawn.measured, drawn.relative_se, self.phases)
        return to_logit(np.column_stack([theta, scale]), self.model.prior), inputs

    def rows(
        self,
        made: PopulationSimulations,
        conditioner: PhaseConditioner,
        eta: Standardisation,
        *name: str | int,
    ) -> Rows:
        """Draw one epoch's rows, standardised; the stream depends on the seed and the name."""
        raw_eta, inputs = self.raw(made, *name)
        return Rows(eta.apply(raw_eta), conditioner.standardise(inputs))


def split_by_context(
    made: PopulationSimulations, held_out_fraction: float
) -> tuple[PopulationSimulations, PopulationSimulations]:
    """Split into training and held-out contexts, the last ones held out: a network must know new hearts.

    Raises:
        ValueError: A side would be empty.
    """
    number = len(made.contexts)
    edge = number - round(held_out_fraction * number)
    if not 0 < edge < number:
        raise ValueError(
            f"{number} contexts cannot be split with validation_fraction = {held_out_fraction}; "
            "simulate more or change the fraction"
        )
    return _part(made, slice(0, edge)), _part(made, slice(edge, number))


def _part(made: PopulationSimulations, rows: slice) -> PopulationSimulations:
    return PopulationSimulations(**{name: value[rows] for name, value in vars(made).items()})


def _passive(made: PopulationSimulations) -> tuple[FloatArray, FloatArray]:
    return made.passive_shape, made.passive_slope


def _flat(values: FloatArray) -> FloatArray:
    return values.reshape(-1, values.shape[-1])


def _each(values: FloatArray, times: int) -> FloatArray:
    return np.repeat(values, times, axis=0)
