"""What the page of an answered subject shows, and the words and numbers in which it is said."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.checks.information import MoreRepeats
from swesbi.checks.predictive import FreePredictiveCheck, PredictiveCheck
from swesbi.checks.scores import Band, coverage
from swesbi.context import CONTEXT, Context
from swesbi.draws import median_and_interval
from swesbi.parameters import PHI
from swesbi.posterior.result import SEPARATOR, ExactPosterior
from swesbi.recording.cohort.clinical import ClinicalMeasures
from swesbi.recording.observation import Observation
from swesbi.recording.samples import REASONS
from swesbi.report.numbers import REJECTIONS, as_percent, digits
from swesbi.verdict.answer_lines import ANSWER_LINES, IN_WORDS
from swesbi.verdict.summary import sampler_in_words, weights_in_words
from swesbi.verdict.verdict import Status, Verdict

MS_PER_S: Final = 1e3
FEW: Final = 20
"""Fewer hearts than this have no percentiles worth the name."""
CONDITIONAL: Final = (
    "All intervals assume that the model can describe the heart. Its unknown properties are averaged over "
    "within the prior."
)


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


def heart_line(context: Context) -> str:
    """Return the subject's heart in a line."""
    said = [
        f"{variable.short} {getattr(context, variable.name):.{variable.digits}f} {variable.shown_unit}"
        for variable in CONTEXT[1:]
    ]
    return f"sex {context.sex}, {', '.join(said)}"


def quality_line(recorded: RecordingSummary) -> str:
    """Return what was accepted and what was not, with the reasons."""
    rejected = sum(recorded.rejected.values())
    told = ", ".join(f"{in_words(reason)} {n}" for reason, n in recorded.rejected.items())
    because = f" ({told})" if told else ""
    return (
        f"Recording: {recorded.summary}. {recorded.accepted} of {recorded.accepted + rejected} "
        f"{recorded.unit} accepted, {rejected} rejected{because}."
        + (f" Errors: {recorded.noise}." if recorded.noise else "")
    )


def in_words(reason: str) -> str:
    """Return why a sample was rejected, amid a sentence."""
    words = REJECTIONS[reason]
    return words[0].lower() + words[1:]


def verdict_text(verdict: Verdict) -> tuple[str, tuple[str, ...]]:
    """Return the verdict in one word, and what is said for it."""
    word = verdict.status
    sentence = verdict.sentence.removeprefix(word).lstrip(" :;,")
    further = (reason for reason in verdict.reasons if reason.partition(": ")[2] not in verdict.sentence)
    return word, tuple(filter(None, (sentence[:1].upper() + sentence[1:], *further)))


def header(sheet: Sheet) -> tuple[str, ...]:
    """Return what heads the columns of :func:`rows`."""
    times = () if sheet.more is None else tuple(f"{each:g}-fold" for each in sheet.more.times)
    mass = as_percent(sheet.result.interval_mass)
    return ("", "median", f"{mass} interval", "time constant (ms)", "percentile", *times)


def rows(sheet: Sheet) -> list[tuple[str, ...]]:
    """Return a row a quantity: median, interval, time constant, percentile, and what more repeats leave."""
    low, median, high = sheet.limits
    more = () if sheet.more is None else tuple(sheet.more.width)
    return [
        (
            f"{line.short} {line.parameter.tex} ({line.parameter.unit})",
            digits(median[j]),
            f"{digits(low[j])} to {digits(high[j])}",
            _time_constant(line.parameter.unit, low[j], median[j], high[j]),
            _percentile(sheet.population.prior[:, j], low[j], median[j], high[j]),
            *(as_percent(round(float(width[j]), 2)) for width in more),
        )
        for j, line in enumerate(ANSWER_LINES)
    ]


def notes(sheet: Sheet) -> list[str]:
    """Return what the numbers are conditional on, and what the columns mean, a paragraph each."""
    return [
        *_caution(sheet),
        quality_line(sheet.recorded),
        *(_with_pressures(each) for each in sheet.informed),
        *conditions(),
        CONDITIONAL,
        f"Time constants are 1000 over the rate in 1/s. Percentile: {sheet.population.name}, of the median "
        "and of both ends of the interval." + _among(sheet.context, sheet.population.hearts),
        _predictive(sheet.curve, sheet.recorded),
        *_more_words(sheet),
        f"Draws by {sampler_in_words(sheet.verdict)}; weights: {weights_in_words(sheet.verdict)} (k-hat at "
        f"most {sheet.result.k_hat_limit:.2f}).",
    ]


def conditions() -> list[str]:
    """Return how far the rows can be relied on and what each is conditional on, a paragraph a group."""
    return [
        f"{IN_WORDS[trust][0].upper()}{IN_WORDS[trust][1:]}: "
        + "; ".join(f"{line.short} ({line.condition})" for line in group)
        + "."
        for trust, group in groupby(ANSWER_LINES, lambda line: line.trust)
    ]


def _time_constant(unit: str, low: float, median: float, high: float) -> str:
    if unit != "1/s":
        return ""
    middle, short, long = (digits(MS_PER_S / rate) for rate in (median, high, low))
    return f"{middle} ({short} to {long})"


def _percentile(population: FloatArray, *values: float) -> str:
    low, median, high = (100.0 * float(np.mean(population <= value)) for value in values)
    return f"{median:.0f} ({low:.0f} to {high:.0f})"


def _caution(sheet: Sheet) -> Iterator[str]:
    if sheet.verdict.status == Status.CONTRADICTED:
        yield (
            "CONTRADICTED: this model cannot produce the recording. Medians and intervals are shown to help "
            "find the reason. They are no measurement of this heart."
        )
    if not sheet.result.converged:
        yield f"NOT CONVERGED, do not use: {SEPARATOR.join(sheet.result.reasons)}"


def _with_pressures(informed: PressuresPosterior) -> str:
    low, median, high = median_and_interval(informed.result.phi, informed.result.interval_mass)
    told = ", ".join(
        f"{parameter.text} {digits(median[j])} [{digits(low[j])}, {digits(high[j])}] {parameter.unit}"
        for j, parameter in enumerate(PHI)
    )
    clinical = informed.clinical
    doubt = "" if informed.result.converged else " NOT CONVERGED, do not use."
    return f"With cuff pressures {clinical.sbp_mmhg:g} / {clinical.dbp_mmhg:g} mmHg as well: {told}.{doubt}"


def _among(context: Context, hearts: Sequence[Context]) -> str:
    """Say where a heart stands among those that it is compared with."""
    if not hearts:
        return ""
    told = []
    for variable in CONTEXT[1:]:
        below = sum(getattr(heart, variable.name) < getattr(context, variable.name) for heart in hearts)
        share = f"{below}" if len(hearts) < FEW else as_percent(round(below / len(hearts), 2))
        told.append(f"{variable.short} {share}")
    return f" Of {len(hearts)} hearts for comparison, so many have less: {', '.join(told)}."


def _predictive(curve: ShownCurve, recorded: RecordingSummary) -> str:
    points = "measured phases" if recorded.unit == "samples" else recorded.unit
    return (
        f"Predictive check: {curve.inside} of {len(curve.phase)} {points} lie in the "
        f"{as_percent(curve.interval)} interval of a new measurement (thick bars); about "
        f"{curve.interval * len(curve.phase):.0f} should."
    )


def _more_words(sheet: Sheet) -> Iterator[str]:
    if sheet.more is not None:
        yield (
            "More data: the expected width of each interval, on a logarithmic scale, with so many "
            f"times as many {sheet.recorded.more} at the same instants, over that of this recording. "
            "Repeats do not reduce the errors of the model."
        )
