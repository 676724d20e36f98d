"""The conditioning vector z of a spline flow: features S(.) of speeds, or log speeds phase by phase.

Features S(.) summarise a curve whose phases and noise a network knows by heart. Where these differ from
recording to recording, the network has to see them: the speed at each phase of the protocol, whether it was
measured, and its standard error; and the three values of the context that set the simulator. The standard
error is the total one. Where phases share errors the network learns from recordings that do, but is not told
how much of a standard error is shared; the exact weights, whose likelihood knows, make up for it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from pydantic import Field

from swesbi.arrays import BoolArray, FloatArray, IntArray
from swesbi.base import Settings
from swesbi.context import CONTEXT_NAMES, CONTEXT_RANGES, Context
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.measurement.settings import SummarySettings, summary_names, summary_units
from swesbi.measurement.speeds import SpeedRecording
from swesbi.measurement.summary import summarise
from swesbi.networks.standardisation import Standardisation, fit_standardisation
from swesbi.recording.phases import nominal_phases, to_grid
from swesbi.recording.speed import youngs_modulus_kpa

LEAST_KPA: Final = 1e-3  # a flat curve has no amplitude and no slope, hence no logarithm of them
LARGEST_Z: Final = 8.0  # what lies farther out is judged by the misspecification tests, not by the network
CONTEXT_INPUTS: Final = tuple(CONTEXT_RANGES)
"""What the simulator takes of a context; nothing else can change a posterior."""


class RecordingConditioner(Protocol):
    """Makes the conditioning vector of a recording, of C named components."""

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the C components."""

    def condition(self, recording: SpeedRecording) -> FloatArray:
        """Return z of one recording; shape (C,)."""


class ConditioningSettings(Settings):
    """How measured speeds become features."""

    summary: SummarySettings
    grid_points: int
    density_kg_m3: float

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the C components of z: features, then context."""
        return (*summary_names(self.summary), *CONTEXT_NAMES)


def conditioning_of(summary: SummarySettings, model: SpeedModelSettings) -> ConditioningSettings:
    """Return how the speeds of a model's recordings become the features of a summary."""
    return ConditioningSettings(
        summary=summary, grid_points=model.measurement.grid_points, density_kg_m3=model.density_kg_m3
    )


def raw_features(speed_m_s: FloatArray, phase: FloatArray, settings: ConditioningSettings) -> FloatArray:
    """Return the features of recordings as the flow sees them, before standardisation; shape (n, F).

    The speeds pass the same operator as the data: E = 3 rho c^2, the periodic interpolant, S(.). What is
    a stiffness, an area or a slope enters by the logarithm of its size, since its noise is proportional.

    Args:
        speed_m_s: Speeds at the measured phases; shape (n, p).
        phase: The phases; shape (p,).
        settings: Summary, grid and density.
    """
    stiffness = youngs_modulus_kpa(speed_m_s, settings.density_kg_m3)
    features = summarise(to_grid(phase, stiffness, settings.grid_points), settings.summary)
    positive = np.array(summary_units(settings.summary)) == "kPa"
    features[:, positive] = np.log(np.maximum(np.abs(features[:, positive]), LEAST_KPA))
    return features


@dataclass(frozen=True)
class Conditioner:
    """Makes conditioning vectors of C components, with the statistics of the training split.

    Attributes:
        settings: How speeds become features.
        features: Statistics of the F features over the training rows.
        context: Statistics of the 7 context values over the subjects trained on.
    """

    settings: ConditioningSettings
    features: Standardisation
    context: Standardisation

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the C components of z."""
        return self.settings.components

    def condition(self, recording: SpeedRecording) -> FloatArray:
        """Return z of one recording; shape (C,)."""
        z: FloatArray = self.condition_many(recording.speed_m_s[None], recording)[0]
        return z

    def condition_many(self, speed_m_s: FloatArray, recording: SpeedRecording) -> FloatArray:
        """Return z of several sets of speeds (n, p) at the phases of one recording; shape (n, C)."""
        raw = raw_features(speed_m_s, recording.phase, self.settings)
        return self.standardise(raw, recording.context)

    def standardise(self, raw: FloatArray, context: Context) -> FloatArray:
        """Standardise raw features (n, F), within bounds, and put the context behind them; shape (n, C)."""
        features = np.clip(self.features.apply(raw), -LARGEST_Z, LARGEST_Z)
        values = self.context.apply(context.as_array())
        return np.hstack([features, np.broadcast_to(values, (len(raw), len(values)))])


def fit_conditioner(
    raw: FloatArray, contexts: tuple[Context, ...], settings: ConditioningSettings
) -> Conditioner:
    """Take the statistics of raw training features (n, F) and of the subjects' contexts."""
    values = np.stack([context.as_array() for context in contexts])
    return Conditioner(settings, fit_standardisation(raw), fit_standardisation(values))


class PhaseSettings(Settings):
    """The phases at which the network sees a recording, and the noise that it was trained on."""

    phases: int = Field(ge=6, le=400, description="phases, at the centres of equal parts of the cycle")
    relative_se: tuple[float, float] = Field(description="standard errors of a mean speed, over the speed")

    @property
    def phase(self) -> FloatArray:
        """The phases themselves; shape (P,)."""
        return nominal_phases(self.phases)

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the C components of z."""
        parts = ("log_speed", "missing", "log_relative_se")
        return (
            *(f"log_{name}" for name in CONTEXT_INPUTS),
            *(f"{part}_phase_{index:02d}" for part in parts for index in range(self.phases)),
        )


@dataclass(frozen=True)
class PhaseConditioner:
    """Makes conditioning vectors of C components, with the statistics of the training rows."""

    settings: PhaseSettings
    inputs: Standardisation

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the C components of z."""
        return self.settings.components

    def condition(self, recording: SpeedRecording) -> FloatArray:
        """Return z of one recording, whatever its phases: each counts where it is nearest; shape (C,)."""
        z: FloatArray = self.standardise(recording_inputs(recording, self.settings))[0]
        return z

    def standardise(self, inputs: FloatArray) -> FloatArray:
        """Standardise inputs (n, C), within bounds."""
        return np.clip(self.inputs.apply(inputs), -LARGEST_Z, LARGEST_Z)


def fit_phase_conditioner(inputs: FloatArray, settings: PhaseSettings) -> PhaseConditioner:
    """Take the statistics of training inputs (n, C)."""
    return PhaseConditioner(settings, fit_standardisation(inputs))


def context_inputs(context: Context) -> FloatArray:
    """Return the logarithms of heart rate, end-diastolic volume and septal thickness; shape (3,)."""
    return np.log([getattr(context, name) for name in CONTEXT_INPUTS])


def phase_inputs(
    context: FloatArray,
    log_speed: FloatArray,
    measured: BoolArray,
    relative_se: FloatArray,
    settings: PhaseSettings,
) -> FloatArray:
    """Return what the network sees of n recordings, before standardisation; shape (n, C).

    Args:
        context: :func:`context_inputs` of each; shape (n, 3).
        log_speed: Log speeds, anything where not measured; shape (n, P).
        measured: Which phases were measured, at least one a recording; shape (n, P).
        relative_se: Total standard errors of the speeds, anything positive where not measured; shape (n, P).
        settings: Phases and the range of standard errors, to which they are clipped.
    """
    low, high = settings.relative_se
    log_se = np.log(np.clip(np.where(measured, relative_se, np.sqrt(low * high)), low, high))
    return np.hstack([context, fill_missing(log_speed, measured), ~measured, log_se])


def fill_missing(values: FloatArray, measured: BoolArray) -> FloatArray:
    """Put the line between the measured neighbours, around the cycle, where nothing was measured; (n, P)."""
    before, after = _neighbours(measured, -1), _neighbours(measured, 1)
    index = np.arange(values.shape[1])
    to_before, to_after = (index - before) % values.shape[1], (after - index) % values.shape[1]
    low, high = (np.take_along_axis(values, at, axis=1) for at in (before, after))
    span = np.maximum(to_before + to_after, 1)
    return np.where(measured, values, (low * to_after + high * to_before) / span)


def recording_inputs(recording: SpeedRecording, settings: PhaseSettings) -> FloatArray:
    """Return what the network sees of one recording, before standardisation; shape (1, C).

    Each measured phase counts in the part of the cycle where it lies, where there are several the one
    nearest to its centre; so none counts twice.
    """
    interval = np.floor(recording.phase * settings.phases).astype(np.int64)
    nearest_last = np.argsort(-np.abs(recording.phase - settings.phase[interval]), kind="stable")
    chosen = np.full(settings.phases, -1)
    chosen[interval[nearest_last]] = nearest_last
    return phase_inputs(
        context_inputs(recording.context)[None],
        np.log(recording.speed_m_s)[None, chosen],
        (chosen >= 0)[None],
        recording.errors.total[None, chosen],
        settings,
    )


def _neighbours(measured: BoolArray, direction: int) -> IntArray:
    """Return the index of the next measured phase in a direction around the cycle, its own if measured."""
    phases = measured.shape[1]
    turned = measured[:, ::-direction]
    twice = np.concatenate([turned, turned], axis=1)
    position = np.where(twice, np.arange(2 * phases), -1)
    latest = np.maximum.accumulate(position, axis=1)[:, phases:] % phases
    return np.asarray(latest if direction < 0 else phases - 1 - latest[:, ::-1])
