"""One subject's observed stiffness curve, with everything that is known of how it was measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.context import Context
from swesbi.recording.quality import REASONS
from swesbi.recording.speed import NoiseComponents

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Observation:
    """The observed curve E_obs,d of one subject (paper, Eq. 1), P phases, G grid points.

    Attributes:
        context: The subject's context c_d.
        phase: Phases of the recording in [0, 1), ascending; shape (P,).
        phase_index: Their indices in the recording; shape (P,).
        measured: Which phases were measured; shape (P,).
        speed_m_s: Mean shear-wave speed c_s; NaN where missing; shape (P,).
        speed_se_m_s: Its standard error; NaN where missing; shape (P,).
        stiffness_kpa: Apparent Young's modulus E = 3 rho c_s^2; NaN where missing; shape (P,).
        stiffness_se_kpa: Its standard error; NaN where missing; shape (P,).
        grid: Uniform analysis grid on [0, 1], both ends included; shape (G,).
        curve_kpa: E on the grid, through the measured phases; shape (G,).
        samples_accepted: Accepted samples per phase; shape (P,).
        samples_by_repeat: Accepted samples of each phase and repeat, repeats ascending; shape (P, repeats).
        samples_rejected: Rejected samples by reason and phase; shape (reasons, P), rows as ``REASONS``.
        noise: Relative standard deviation between repeats and between samples, of this recording.
    """

    context: Context
    phase: FloatArray
    phase_index: NDArray[np.int64]
    measured: NDArray[np.bool_]
    speed_m_s: FloatArray
    speed_se_m_s: FloatArray
    stiffness_kpa: FloatArray
    stiffness_se_kpa: FloatArray
    grid: FloatArray
    curve_kpa: FloatArray
    samples_accepted: NDArray[np.int64]
    samples_by_repeat: NDArray[np.int64]
    samples_rejected: NDArray[np.int64]
    noise: NoiseComponents

    @property
    def subject(self) -> str:
        """The subject's name."""
        return self.context.subject

    @property
    def measured_phase(self) -> FloatArray:
        """The phases that were measured; shape (p,)."""
        return self.phase[self.measured]

    @property
    def rejected(self) -> dict[str, int]:
        """Number of rejected samples by reason, over all phases."""
        counts = self.samples_rejected.sum(axis=1)
        return {reason: int(count) for reason, count in zip(REASONS, counts, strict=True)}
