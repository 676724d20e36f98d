"""The two tables of the validation: a row a generator and quantity, and a row a generator.

Rows of hearts of several generators together, counted heart by heart, stand behind those of each generator.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Final

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from studies.validation.score import HeartAnswer
from studies.validation.settings import ScoreSettings
from swesbi.base.arrays import FloatArray
from swesbi.report.tables.validation import (
    NOT_TESTED,
    POOLED_ALL,
    POOLED_TOGETHER,
    QUANTITIES,
    TESTED,
    TOGETHER,
)
from swesbi.verdict.summary import REFUSED
from swesbi.verdict.verdict import GRADES, Status

NO_NUMBER: Final = (np.nan, np.nan, np.nan)


def validation_table(
    answers: Mapping[str, Sequence[HeartAnswer]],
    titles: Mapping[str, str],
    settings: ScoreSettings,
) -> pd.DataFrame:
    """Return one row a generator and quantity, those of generators together last.

    Verdicts are shares of the ``n`` hearts that have the quantity; coverage is the share of the answered in
    their interval. ``missed_not_contradicted`` is the share of those not contradicted whose peak active
    stiffness or k_SR lies outside.

    ``bias_log`` is the mean over the answered of log median / truth, ``width_log`` their median of log high /
    low; at a known scale of the speeds see :func:`studies.validation.score.width_at_fixed_scale`. Limits are
    Clopper-Pearson's. What is said of those not contradicted is empty where the generator is not tested.
    """
    groups = [(f"{letter}: {titles[letter]}", of_letter) for letter, of_letter in answers.items()]
    rows = [
        {"generator": name} | _row(hearts, column, settings)
        for name, hearts in (*groups, *_pooled(answers))
        for column in range(len(QUANTITIES))
        if np.isfinite([answer.truth[column] for answer in hearts]).any()
    ]
    return pd.DataFrame(rows)


def _pooled(answers: Mapping[str, Sequence[HeartAnswer]]) -> Iterator[tuple[str, list[HeartAnswer]]]:
    """Yield hearts of several generators together: of those of ``TOGETHER``, where all are there; of all."""
    if answers.keys() >= {*TOGETHER}:
        yield POOLED_TOGETHER, [answer for letter in TOGETHER for answer in answers[letter]]
    yield POOLED_ALL, [answer for of_letter in answers.values() for answer in of_letter]


def _row(answers: Sequence[HeartAnswer], column: int, settings: ScoreSettings) -> dict[str, object]:
    having = [answer for answer in answers if np.isfinite(answer.truth[column])]
    answered = [answer for answer in having if answer.asked[column]]
    not_contradicted = [answer for answer in answered if answer.not_contradicted]
    tested = len(not_contradicted) >= settings.least_not_contradicted
    rates = {
        "coverage": rate([answer.covered[column] for answer in answered], settings.confidence),
        "coverage_not_contradicted": NO_NUMBER,
        "missed_not_contradicted": NO_NUMBER,
    }
    if tested:
        covered = [answer.covered[column] for answer in not_contradicted]
        missed = [answer.missed for answer in not_contradicted]
        rates["coverage_not_contradicted"] = rate(covered, settings.confidence)
        rates["missed_not_contradicted"] = rate(missed, settings.confidence)
    shares = _shares(having)
    refused = {REFUSED: shares.pop(REFUSED)}
    asked = {name: rate[0] for name, rate in rates.items()}
    limits: dict[str, object] = {}
    for name, (_, low, high) in rates.items():
        limits |= {f"{name}_low": low, f"{name}_high": high}
    counted = {"n_not_contradicted": len(not_contradicted), "tested": TESTED if tested else NOT_TESTED}
    of_quantity = {"quantity": QUANTITIES[column], "n": len(having)}
    return of_quantity | shares | asked | logs(answered, column) | refused | limits | counted


def _shares(answers: Sequence[HeartAnswer]) -> dict[str, float]:
    """Return the share of each outcome; what is uninformative is not contradicted either."""
    words = [Status.NOT_CONTRADICTED if answer.not_contradicted else answer.status for answer in answers]
    return {
        name.replace(" ", "_"): float(np.mean([word == name for word in words]))
        for name in (*GRADES, REFUSED)
    }


def rate(held: Sequence[bool], confidence: float) -> tuple[float, float, float]:
    """Return the share that holds with its Clopper-Pearson limits, NaN of none."""
    if not held:
        return NO_NUMBER
    interval = binomtest(int(np.sum(held)), len(held)).proportion_ci(confidence, method="exact")
    return float(np.mean(held)), float(interval.low), float(interval.high)


def logs(answers: Sequence[HeartAnswer], column: int) -> dict[str, object]:
    """Return bias and both widths in log; NaN of none."""
    names = ("bias_log", "width_log", "width_log_scale_fixed")
    if not answers:
        return dict(zip(names, NO_NUMBER, strict=True))
    truth, low, median, high = (_column(answers, name, column) for name in ("truth", "low", "median", "high"))
    widths = np.log(high / low), _column(answers, "width_log_scale_fixed", column)
    numbers = (np.log(median / truth).mean(), *(np.median(width) for width in widths))
    return dict(zip(names, map(float, numbers), strict=True))


def _column(answers: Sequence[HeartAnswer], name: str, column: int) -> FloatArray:
    return np.array([getattr(answer, name)[column] for answer in answers])


def samplers_table(answers: Mapping[str, Sequence[HeartAnswer]], titles: Mapping[str, str]) -> pd.DataFrame:
    """Return one row a generator: hearts, refused and redrawn are numbers.

    ``efficiency`` is the median over the answered; ``by_mcmc`` and ``not_converged`` are shares of them.
    """
    rows = []
    for letter, of_letter in answers.items():
        answered = [answer for answer in of_letter if answer.status != REFUSED]
        rows.append(
            {
                "generator": f"{letter}: {titles[letter]}",
                "hearts": len(of_letter),
                "refused": len(of_letter) - len(answered),
                "redrawn": sum(answer.redrawn for answer in of_letter),
                "efficiency": _of_answered(np.median, [answer.efficiency for answer in answered]),
                "by_mcmc": _of_answered(np.mean, [answer.by_mcmc for answer in answered]),
                "not_converged": _of_answered(np.mean, [not answer.converged for answer in answered]),
            }
        )
    return pd.DataFrame(rows)


def _of_answered(statistic: Callable[[Sequence[float]], object], values: Sequence[float]) -> float:
    return float(np.asarray(statistic(values))) if values else np.nan
