"""Calibration as one long table: a row a recording, sampler and quantity, whatever made the recording.

How recordings were made, whose they are and in which stratum they lie are columns. Every table of results
follows by grouping: checks (uniform ranks, coverage at all levels, contraction) and coverage of intervals.
The rates of the verdict's alarms on the same recordings have a table of their own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Annotated, Any, Final

import numpy as np
import pandas as pd

from swesbi.artefacts.csv import Table
from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.checks.calibration.dataset import TwoSamples
from swesbi.checks.calibration.ranks import (
    QUANTITY_NAMES,
    SAMPLERS,
    RankedRecordings,
    central_level,
    uniformity,
)
from swesbi.checks.settings import JudgementSettings, RecoverySettings
from swesbi.draws import interval_levels
from swesbi.parameters import THETA_NAMES
from swesbi.verdict.nulls import TESTS as MISFIT_TESTS
from swesbi.verdict.nulls import Misfits, overall_p, p_values, single_level
from swesbi.verdict.settings import RuleSettings
from swesbi.verdict.verdict import Status

JOINT: Final = "joint"
TESTS: Final = ("sbc", "coverage", "tarp", "contraction", "c2st")
SBC, COVERAGE, TARP, CONTRACTION, C2ST = TESTS
REPORTED_LEVEL: Final = 0.9
POOLED: Final = "pooled"
LOCAL: Final = "local"
NONE_LOST: Final = 0.0  # a second recording must not widen the posterior that the first one gave
GROUP: Final = ("subject", "recordings", "sampler")
COLUMNS: Final = (
    *GROUP, "test", "quantity", "n", "statistic", "p_value", "limit", "flagged", "coverage_90", "contraction",
)  # fmt: skip
CalibrationTable = Annotated[pd.DataFrame, Table(columns=COLUMNS)]
"""``calibration.csv``."""
StrataTable = Annotated[
    pd.DataFrame,
    Table(
        columns=(
            "sampler", "stratum", "parameter", "nominal", "coverage", "ci_low", "ci_high", "n",
            "median_efficiency",
        ),
        row="stratum",
    ),
]  # fmt: skip
"""``strata.csv``."""
DOUBTFUL_OR_WORSE: Final = "doubtful or contradicted"
ALARMS: Final = (*MISFIT_TESTS, DOUBTFUL_OR_WORSE, Status.CONTRADICTED)
ALARM_COLUMNS: Final = ("recordings", "alarm", "rate", "ci_low", "ci_high", "n")
AlarmTable = Annotated[pd.DataFrame, Table(columns=ALARM_COLUMNS, texts=("recordings", "alarm"), digits=None)]
"""``alarms.csv``: the share of one kind of recordings on which one alarm is raised, a row each."""
CoverageSettings = RecoverySettings | JudgementSettings
"""Which say what intervals are scored."""


def long_table(ranked: Mapping[str, RankedRecordings]) -> pd.DataFrame:
    """Return a row a recording, sampler and quantity, by how the recordings were made.

    The joint coverage is a quantity as well, "joint": its level is the mass of the region that contains the
    truth, and it has no moments. ``number`` counts the recordings of one kind.
    """
    return pd.concat(
        [_rows(kind, sampler, recordings) for kind, recordings in ranked.items() for sampler in SAMPLERS],
        ignore_index=True,
    )


def _rows(kind: str, sampler: str, ranked: RankedRecordings) -> pd.DataFrame:
    scores, names = ranked.of(sampler), (*ranked.names, JOINT)
    count, none = len(ranked.subject), np.full(len(ranked.subject), np.nan)
    columns = {
        "truth": (ranked.truth, none),
        "level": (scores.level, scores.tarp),
        "mean": (scores.mean, none),
        "variance": (scores.sd**2, none),
        "prior_variance": (ranked.prior_variance, none),
    }
    return pd.DataFrame(
        {
            "recordings": kind,
            "number": np.repeat(np.arange(count), len(names)),
            "subject": np.repeat(ranked.subject.astype(object), len(names)),
            "sampler": sampler,
            "quantity": np.tile(np.array(names, dtype=object), count),
        }
        | {name: np.column_stack(values).ravel() for name, values in columns.items()}
    )


def judge(rows: pd.DataFrame, settings: JudgementSettings) -> pd.DataFrame:
    """Return one row a check of each subject, kind of recordings and sampler of a long table.

    The subject is ``POOLED`` where recordings are judged together. ``test`` is "sbc" (ranks uniform),
    "coverage" (of central intervals, all nominal levels), "tarp" (joint coverage, all levels) or
    "contraction". ``statistic`` is the largest distance of the distribution function from the uniform one, or
    the contraction. ``limit`` flags a p-value or a contraction below it. That of p-values is shared
    (Bonferroni) by the quantities of one set of bands, and by subjects that are looked at one by one. At
    subjects' own data ("local") contraction is against the posterior given the first recording, and must only
    be above zero. Nuisances need not contract. ``coverage_90`` is the share of truths in the central 90 %
    interval, or in the 90 % region of "tarp".
    """
    subjects = rows.groupby("recordings")["subject"].nunique()
    found: list[dict[str, Any]] = []
    for key, part in rows.groupby(list(GROUP), sort=False):
        labels = dict(zip(GROUP, key, strict=True))
        alpha = settings.alpha / subjects[str(labels["recordings"])]
        shared = alpha / (part["quantity"].nunique() - 1)  # the joint coverage has all of alpha
        least = NONE_LOST if labels["recordings"] == LOCAL else settings.least_contraction
        checks = [
            labels | check
            for name, one in part.groupby("quantity", sort=False)
            for check in _checks(str(name), one, alpha if name == JOINT else shared, least)
        ]
        found += sorted(checks, key=lambda check: TESTS.index(check["test"]))
    return pd.DataFrame(found, columns=list(COLUMNS))


def _checks(name: str, rows: pd.DataFrame, limit: float, least: float) -> Iterator[dict[str, Any]]:
    """Return the checks of one quantity."""
    level, held = rows["level"].to_numpy(), contraction(rows)
    inside = level <= REPORTED_LEVEL if name == JOINT else covered(level, REPORTED_LEVEL)
    of = {"quantity": name, "n": len(level), "contraction": held}
    tests = {TARP: level} if name == JOINT else {SBC: level, COVERAGE: central_level(level)}
    for test, levels in tests.items():
        tested = uniformity(levels)
        judged = {"statistic": tested.distance, "p_value": tested.p_value, "limit": limit}
        flagged = int(tested.p_value < limit)
        yield of | judged | {"test": test, "flagged": flagged, "coverage_90": float(inside.mean())}
    if name in QUANTITY_NAMES and not np.isnan(held):
        yield of | {"test": CONTRACTION, "statistic": held, "limit": least, "flagged": int(held < least)}


def covered(level: FloatArray, mass: float) -> BoolArray:
    """Return where the equal-tailed interval of this mass contains the truth, whose levels are given."""
    low, high = interval_levels(mass)
    return np.asarray((level >= low) & (level <= high))


def contraction(rows: pd.DataFrame) -> float:
    """Return 1 - mean posterior variance / mean prior variance; NaN for a quantity that has none."""
    return float(1.0 - rows["variance"].mean(skipna=False) / rows["prior_variance"].mean(skipna=False))


def proportion(raised: BoolArray, confidence: float) -> tuple[float, float, float]:
    """Return the share that is true, and the ends of its Clopper-Pearson interval."""
    return float(raised.mean()), *binomial_ends(int(raised.sum()), len(raised), confidence)


def binomial_ends(raised: int, of: int, confidence: float) -> tuple[float, float]:
    """Return the ends of the Clopper-Pearson interval on a share, given as a number out of others."""
    from scipy.stats import binomtest

    ends = binomtest(raised, of).proportion_ci(confidence, method="exact")
    return float(ends.low), float(ends.high)


def coverage(rows: pd.DataFrame, by: Sequence[str], settings: CoverageSettings) -> pd.DataFrame:
    """Return a row a group, parameter of theta and nominal level: how often intervals contain the truth.

    ``by`` are the columns of a long table whose values make the groups. ``ci_low`` and ``ci_high`` are the
    Clopper-Pearson interval on ``coverage``, ``bias`` is the mean of posterior mean minus truth in the
    parameter's unit, and ``n`` counts the recordings.
    """
    of_theta = rows[rows["quantity"].isin(THETA_NAMES)].rename(columns={"quantity": "parameter"})
    found: list[dict[str, object]] = []
    for key, part in of_theta.groupby([*by, "parameter"], sort=False):
        labels = dict(zip([*by, "parameter"], key, strict=True))
        moments = {"bias": (part["mean"] - part["truth"]).mean(), "contraction": contraction(part)}
        for nominal in settings.nominal_levels:
            share, low, high = proportion(covered(part["level"].to_numpy(), nominal), settings.confidence)
            ends = {"coverage": share, "ci_low": low, "ci_high": high, "n": len(part)}
            found.append(labels | {"nominal": nominal} | ends | moments)
    return pd.DataFrame(found)


def classifier_rows(two_samples: TwoSamples, limit: float) -> pd.DataFrame:
    """Return the checks by a classifier: ``statistic`` is its accuracy, ``sampler`` the pair it tells apart.

    An accuracy above the limit is flagged, and NaN as well.
    """
    found = []
    for (i, subject), (j, pair) in product(enumerate(two_samples.subject), enumerate(two_samples.pair)):
        draws, accuracy = two_samples.draws[i, j], two_samples.accuracy[i, j]
        if np.isnan(draws):  # of this subject there are no long chains
            continue
        labels = {"subject": subject, "recordings": LOCAL, "sampler": pair, "test": C2ST, "quantity": JOINT}
        judged = {"statistic": accuracy, "limit": limit, "flagged": int(not accuracy <= limit)}
        found.append(labels | {"n": int(draws)} | judged)
    return pd.DataFrame(found, columns=list(COLUMNS))


def alarms(misfits: Misfits, null: Misfits, rule: RuleSettings) -> dict[str, BoolArray]:
    """Return which of ``ALARMS`` are raised on n recordings, among null recordings; shape (n,) each."""
    test_p = p_values(null, misfits, rule)
    flagged, overall = test_p <= single_level(rule.doubtful_level), overall_p(test_p)
    columns = (*flagged.T, overall <= rule.doubtful_level, overall <= rule.contradicted_level)
    return dict(zip(ALARMS, columns, strict=True))


def alarm_table(raised: Mapping[str, Mapping[str, BoolArray]], confidence: float) -> pd.DataFrame:
    """Return the rate of every alarm with its Clopper-Pearson interval, by kind of recordings and alarm."""
    rows = [
        (kind, alarm, *proportion(of, confidence), len(of))
        for kind, by_alarm in raised.items()
        for alarm, of in by_alarm.items()
    ]
    return pd.DataFrame(rows, columns=list(ALARM_COLUMNS))
