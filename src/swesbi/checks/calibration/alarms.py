"""How often the tests of the verdict raise an alarm on recordings that the model itself makes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Final

import pandas as pd

from swesbi.artefacts.csv import Table
from swesbi.base.arrays import BoolArray
from swesbi.checks.calibration.table import proportion
from swesbi.verdict.misfits import TESTS, Misfits
from swesbi.verdict.nulls import overall_p, p_values, single_level
from swesbi.verdict.settings import RuleSettings
from swesbi.verdict.verdict import Status

DOUBTFUL_OR_WORSE: Final = "doubtful or contradicted"
ALARMS: Final = (*TESTS, DOUBTFUL_OR_WORSE, Status.CONTRADICTED)
COLUMNS: Final = ("recordings", "alarm", "rate", "ci_low", "ci_high", "n")
AlarmTable = Annotated[pd.DataFrame, Table(columns=COLUMNS, texts=("recordings", "alarm"), digits=None)]
"""``alarms.csv``: the share of one kind of recordings on which one alarm is raised, a row each."""


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
    return pd.DataFrame(rows, columns=list(COLUMNS))
