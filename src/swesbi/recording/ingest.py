"""From the raw samples of one recording to the observed stiffness curve."""

from __future__ import annotations

import numpy as np

from swesbi.context import Context
from swesbi.observation.interpolation import analysis_grid, to_grid
from swesbi.recording.completeness import incomplete
from swesbi.recording.elasticity import youngs_modulus_kpa
from swesbi.recording.observation import Observation
from swesbi.recording.phases import locate_phases
from swesbi.recording.plausibility import implausible
from swesbi.recording.problems import Problem, RecordingError, raise_any
from swesbi.recording.quality import ACCEPTED, REASONS, count_by_phase, count_by_repeat, ectopic, rejection
from swesbi.recording.samples import Samples
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import average_speeds


def ingest(samples: Samples, context: Context, settings: RecordingSettings, grid_size: int) -> Observation:
    """Turn raw samples into the observed curve of one subject.

    Quality control; spatial mean of c_s at each phase; then E = 3 rho c_s^2, in this order, since the
    mean of squares exceeds the square of the mean; then the periodic interpolant on the analysis grid.
    A missing phase is interpolated on the grid and marked by ``measured``.

    Args:
        samples: The recording.
        context: The subject's context.
        settings: Quality limits and density.
        grid_size: Number of grid points G.

    Raises:
        RecordingError: The recording is too incomplete, its phases make no sense, or it cannot be of
            this context.
    """
    verdict = rejection(samples, settings)
    accepted, rejected = count_by_phase(samples, verdict, settings.phases)
    if not accepted.any():
        counts = ", ".join(f"{reason} {n}" for reason, n in zip(REASONS, rejected.sum(axis=1), strict=True))
        raise RecordingError(Problem(samples.source, f"no sample is acceptable ({counts})", "record again"))
    raise_any(implausible(samples, verdict == ACCEPTED, context, settings))
    speeds = average_speeds(samples, verdict == ACCEPTED, settings.phases)
    regular = ~ectopic(samples, settings.max_rr_deviation_fraction)
    located = locate_phases(samples, speeds.beat_phase, regular)
    order = np.argsort(located)
    phase, speed, error = located[order], speeds.speed_m_s[order], speeds.speed_se_m_s[order]
    measured = ~np.isnan(speed)
    raise_any(incomplete(phase, measured, settings, samples.source))
    stiffness = youngs_modulus_kpa(speed, settings.density_kg_m3)
    return Observation(
        context=context,
        phase=phase,
        phase_index=order,
        measured=measured,
        speed_m_s=speed,
        speed_se_m_s=error,
        stiffness_kpa=stiffness,
        stiffness_se_kpa=2.0 * stiffness * error / speed,  # first order: dE / E = 2 dc / c
        grid=analysis_grid(grid_size),
        curve_kpa=to_grid(phase[measured], stiffness[measured], grid_size),
        samples_accepted=accepted[order],
        samples_by_repeat=count_by_repeat(samples, verdict == ACCEPTED, settings.phases)[order],
        samples_rejected=rejected[:, order],
        noise=speeds.noise,
    )


__all__ = ["ingest", "youngs_modulus_kpa"]
