"""How often the tests of the verdict raise an alarm on recordings that the model itself makes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Annotated, Final

import pandas as pd

from swesbi.artefacts.csv import Table
from swesbi.base.arrays import BoolArray
from swesbi.verdict.misfits import TESTS, Misfits
from swesbi.verdict.nulls import overall_p, p_values, single_level
from swesbi.verdict.settings import RuleSettings
from swesbi.verdict.verdict import Status

DOUBTFUL_OR_WORSE: Final = "doubtful or contradicted"
ALARMS: Final = (*TESTS, DOUBTFUL_OR_WORSE, Status.CONTRADICTED)
CONFIDENCE: Final = 0.95


@dataclass(frozen=True)
class AlarmRow:
    """The share of one kind of recordings on which one alarm is raised; a row of ``alarms.csv``.

    Attributes:
        recordings: Kind of the recordings.
        alarm: A test, or a verdict.
        rate: Share of the recordings on which it is raised.
        ci_low: Lower end of the 95 % Clopper-Pearson interval on the rate.
        ci_high: Its upper end.
        n: Recordings.
    """

    recordings: str
    alarm: str
    rate: float
    ci_low: float
    ci_high: float
    n: int


TABLE: Final = Table(
    columns=tuple(field.name for field in fields(AlarmRow)), texts=("recordings", "alarm"), digits=None
)
AlarmTable = Annotated[pd.DataFrame, TABLE]
"""``alarms.csv``: one :class:`AlarmRow` a row."""


def alarm_rows(misfits: Mapping[str, Misfits], null: Misfits, rule: RuleSettings) -> tuple[AlarmRow, ...]:
    """Return the rate of every alarm on every kind of recordings.

    Args:
        misfits: What the tests look at, by kind of recordings.
        null: The same of null recordings.
        rule: Levels of the verdict.
    """
    raised = {kind: alarms(part, null, rule) for kind, part in misfits.items()}
    return tuple(_row(kind, alarm, part) for kind, by in raised.items() for alarm, part in by.items())


def alarms(misfits: Misfits, null: Misfits, rule: RuleSettings) -> dict[str, BoolArray]:
    """Return which of ``ALARMS`` are raised on n recordings; shape (n,) each."""
    test_p = p_values(null, misfits, rule)
    flagged, overall = test_p <= single_level(rule.doubtful_level), overall_p(test_p)
    columns = (*flagged.T, overall <= rule.doubtful_level, overall <= rule.contradicted_level)
    return dict(zip(ALARMS, columns, strict=True))


def _row(kind: str, alarm: str, raised: BoolArray) -> AlarmRow:
    from scipy.stats import binomtest

    interval = binomtest(int(raised.sum()), len(raised)).proportion_ci(CONFIDENCE, method="exact")
    low, high = float(interval.low), float(interval.high)
    return AlarmRow(kind, alarm, float(raised.mean()), low, high, len(raised))
