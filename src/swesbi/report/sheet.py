"""What the page of an answered subject shows: recording, prediction, posterior, with whom it is compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from swesbi.base.arrays import FloatArray
from swesbi.checks.information import MoreRepeats
from swesbi.checks.predictive import FreePredictiveCheck, PredictiveCheck
from swesbi.checks.scores import Band, coverage
from swesbi.context import Context
from swesbi.draws import median_and_interval
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.cohort.clinical import ClinicalMeasures
from swesbi.recording.observation import Observation
from swesbi.recording.samples import REASONS
from swesbi.verdict.verdict import Verdict


@dataclass(frozen=True)
class RecordingSummary:
    """What was recorded, and what quality control made of it.

    ``unit`` is what is counted ("samples", "pushes"), ``more`` what one could record more of ("repeats",
    "pushes"), ``rejected`` how many were, by reason, and ``noise`` what standard errors are estimated from.
    """

    summary: str
    unit: str
    more: str
    accepted: int
    rejected: Mapping[str, int]
    noise: str = ""


@dataclass(frozen=True)
class ShownCurve:
    """The recording beside what prior and posterior predict of it; p measured points, G of the grid.

    ``new`` is the interval of a new measurement at each of the points, ``interval`` the mass of bands and
    intervals. ``noisy`` bands are those of new measurements, and not of noiseless curves.
    """

    grid: FloatArray
    prior: Band
    posterior: Band
    phase: FloatArray
    stiffness_kpa: FloatArray
    se_kpa: FloatArray
    new: Band
    interval: float
    noisy: bool

    @property
    def inside(self) -> int:
        """How many of the points lie in the interval of a new one."""
        return round(coverage(self.stiffness_kpa, self.new) * len(self.phase))


@dataclass(frozen=True)
class PressuresPosterior:
    """The posterior with the pressures of a cuff, and these."""

    clinical: ClinicalMeasures
    result: ExactPosterior


@dataclass(frozen=True)
class Population:
    """Whom the subject is compared with.

    ``name`` says in words whose prior percentiles are of, ``prior`` has draws of all that is reported (m,
    q). ``hearts`` are other hearts, of which there may be none.
    """

    name: str
    prior: FloatArray
    hearts: Sequence[Context]


@dataclass(frozen=True)
class Sheet:
    """All that the page of a subject shows.

    ``values`` are draws of all that is reported, in the order of ``answer_lines.ANSWER_LINES``; (n, q).
    ``more`` is None where it cannot be told. ``informed`` has one posterior with pressures or none.
    """

    context: Context
    verdict: Verdict
    result: ExactPosterior
    values: FloatArray
    recorded: RecordingSummary
    curve: ShownCurve
    population: Population
    more: MoreRepeats | None
    informed: Sequence[PressuresPosterior]
    cohort_title: str

    @property
    def limits(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Lower end, median and upper end of the credible intervals; (q,) each."""
        return median_and_interval(self.values, self.result.interval_mass)


def recorded_gated(observed: Observation) -> RecordingSummary:
    """Return the quality of a gated recording."""
    rejected = observed.samples_rejected.sum(axis=1)
    repeats = (observed.samples_by_repeat > 0).sum(axis=1)[observed.measured]
    least, most = int(repeats.min()), int(repeats.max())
    each = f"{least}" if least == most else f"{least} to {most}"
    missing = [f"{phase:.3f}" for phase in observed.phase[~observed.measured]]
    return RecordingSummary(
        summary=f"{int(observed.measured.sum())} of {len(observed.phase)} gated phases measured, {each} "
        "repeats each" + (f"; missing at {', '.join(missing)} of the cycle" if missing else ""),
        unit="samples",
        more="repeats",
        accepted=int(observed.samples_accepted.sum()),
        rejected={reason: int(n) for reason, n in zip(REASONS, rejected, strict=True) if n},
    )


def recorded_free(observed: Observation) -> RecordingSummary:
    """Return the quality of a free-running recording."""
    beats = f" in {observed.beats} beats" if observed.beats > 1 else ""
    return RecordingSummary(
        summary=f"free-running{beats}",
        unit="pushes",
        more="pushes",
        accepted=int(observed.measured.sum()),
        rejected={reason: n for reason, n in observed.rejected.items() if n},
    )


def curve_gated(check: PredictiveCheck) -> ShownCurve:
    """Return the recording of a gated subject and its predictive check."""
    target, new = check.target, check.posterior.phases
    measured = target.measured
    return ShownCurve(
        grid=target.grid,
        prior=check.prior.curve,
        posterior=check.posterior.curve,
        phase=target.phase[measured],
        stiffness_kpa=target.stiffness_kpa[measured],
        se_kpa=target.stiffness_se_kpa[measured],
        new=Band(new.median[measured], new.low[measured], new.high[measured]),
        interval=check.interval,
        noisy=True,
    )


def curve_free(check: FreePredictiveCheck) -> ShownCurve:
    """Return the pushes of a free-running recording and their predictive check."""
    return ShownCurve(
        grid=check.grid,
        prior=check.prior,
        posterior=check.posterior,
        phase=check.phase,
        stiffness_kpa=check.stiffness_kpa,
        se_kpa=2.0 * check.relative_se * check.stiffness_kpa,
        new=check.pushes,
        interval=check.interval,
        noisy=False,
    )
