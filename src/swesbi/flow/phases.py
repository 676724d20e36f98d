"""The conditioning vector z of a flow for any context: log speeds phase by phase, what is missing, how noisy.

Features S(.) summarise a curve whose phases and noise a network knows by heart. Where these differ from
recording to recording, the network has to see them: the speed at each phase of the protocol, whether it was
measured, and its standard error; and the three values of the context that set the simulator.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from swesbi.context import CONTEXT_RANGES, Context
from swesbi.inference.standardisation import Standardisation, fit_standardisation
from swesbi.recording.phases import nominal_phases
from swesbi.settings import Settings
from swesbi.speed_model.recording import SpeedRecording

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
CONTEXT_INPUTS: Final = tuple(CONTEXT_RANGES)
"""What the simulator takes of a context; nothing else can change a posterior."""
LARGEST_PHASE_Z: Final = (
    8.0  # a recording farther out is judged by the misspecification tests, not by the network
)


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
        return np.clip(self.inputs.apply(inputs), -LARGEST_PHASE_Z, LARGEST_PHASE_Z)


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
        relative_se: Standard errors of the speeds, anything positive where not measured; shape (n, P).
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
    part = np.floor(recording.phase * settings.phases).astype(np.int64)
    nearest_last = np.argsort(-np.abs(recording.phase - settings.phase[part]), kind="stable")
    chosen = np.full(settings.phases, -1)
    chosen[part[nearest_last]] = nearest_last
    return phase_inputs(
        context_inputs(recording.context)[None],
        np.log(recording.speed_m_s)[None, chosen],
        (chosen >= 0)[None],
        recording.relative_se[None, chosen],
        settings,
    )


def _neighbours(measured: BoolArray, direction: int) -> NDArray[np.int64]:
    """Return the index of the next measured phase in a direction around the cycle, its own if measured."""
    phases = measured.shape[1]
    turned = measured[:, ::-direction]
    twice = np.concatenate([turned, turned], axis=1)
    position = np.where(twice, np.arange(2 * phases), -1)
    latest = np.maximum.accumulate(position, axis=1)[:, phases:] % phases
    return np.asarray(latest if direction < 0 else phases - 1 - latest[:, ::-1])
