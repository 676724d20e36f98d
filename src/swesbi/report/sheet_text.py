"""The answer to one subject in words and numbers, as its one page prints it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.context import CONTEXT, Context
from swesbi.draws import median_and_interval
from swesbi.parameters import PHI
from swesbi.posterior.result import SEPARATOR
from swesbi.report.numbers import REJECTIONS, as_percent, digits
from swesbi.report.sheet import PressuresPosterior, RecordingSummary, Sheet, ShownCurve
from swesbi.verdict.answer_lines import ANSWER_LINES, IN_WORDS
from swesbi.verdict.summary import sampler_in_words, weights_in_words
from swesbi.verdict.verdict import Status, Verdict

MS_PER_S: Final = 1e3
FEW: Final = 20
"""Fewer hearts than this have no percentiles worth the name."""
CONDITIONAL: Final = (
    "All intervals assume that the model can describe the heart. Its unknown properties are integrated out "
    "within the prior."
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
