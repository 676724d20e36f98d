"""How often the tests raise an alarm: on well-specified recordings, and on the virtual volunteers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.base.arrays import BoolArray, below_each_other
from swesbi.verdict.nulls import Grade, Judgement, Reference
from swesbi.verdict.recordings import ACQUIRED, OWN, VOLUNTEER, SubjectChecks
from swesbi.verdict.settings import RuleSettings
from swesbi.verdict.statistics import GROUPS, TESTS, Checks
from swesbi.verdict.verdict import Status

COHORT: Final = "all"
STRAINED_OR_WORSE: Final = "strained or contradicted"
CONFIDENCE: Final = 0.95


@dataclass(frozen=True)
class AlarmRow:
    """The share of one kind of recordings on which one alarm is raised; a row of ``misspecification.csv``.

    Attributes:
        subject: Name, or "all" for the whole cohort.
        recordings: Kind of the recordings.
        alarm: A test, a group of tests, or a verdict.
        rate: Share of the recordings on which it is raised.
        ci_low: Lower end of the 95 % Clopper-Pearson interval on the rate.
        ci_high: Its upper end.
        n: Recordings.
        refused: Further recordings that ingestion refused.
        median_efficiency: Median effective share of the weighted draws over the recordings.
    """

    subject: str
    recordings: str
    alarm: str
    rate: float
    ci_low: float
    ci_high: float
    n: int
    refused: int
    median_efficiency: float


@dataclass(frozen=True)
class _Alarms:
    """Which alarms are raised on n recordings of one subject; ``raised`` maps each alarm to shape (n,)."""

    subject: str
    kind: str
    raised: dict[str, BoolArray]
    checks: Checks
    refused: int


def alarm_rows(subjects: Sequence[SubjectChecks], settings: RuleSettings) -> tuple[AlarmRow, ...]:
    """Return the rates of every alarm, subject and kind of recordings, and of the cohort together.

    Each volunteer is of another kind, so they are not put together.
    """
    by_subject = [alarms for checks in subjects for alarms in _subject_alarms(checks, settings)]
    pooled = [_pool([part for part in by_subject if part.kind == kind]) for kind in (OWN, ACQUIRED)]
    return tuple(row for alarms in (*by_subject, *pooled) for row in _rows(alarms))


def _subject_alarms(checks: SubjectChecks, settings: RuleSettings) -> Iterator[_Alarms]:
    reference = checks.reference(settings)
    for kind in (OWN, ACQUIRED, VOLUNTEER):
        recordings = checks.recordings[kind]
        if len(recordings):
            raised = _raised(reference, reference.judge(recordings))
            yield _Alarms(checks.subject, kind, raised, recordings, checks.refused[kind])


def _raised(reference: Reference, judgement: Judgement) -> dict[str, BoolArray]:
    """Return which alarms are raised at the level of "strained", and which verdicts are reached."""
    flagged = judgement.test_p <= reference.joint.thresholds(reference.strained_level)
    tests = {test.name: flagged[:, index] for index, test in enumerate(TESTS)}
    groups: dict[str, BoolArray] = {
        f"group: {group}": np.asarray(flagged[:, list(members)].any(axis=1))
        for group, members in zip(GROUPS, reference.joint.members, strict=True)
    }
    verdicts: dict[str, BoolArray] = {
        STRAINED_OR_WORSE: judgement.status >= Grade.STRAINED,
        Status.CONTRADICTED: judgement.status >= Grade.CONTRADICTED,
    }
    return {**tests, **groups, **verdicts}


def _pool(parts: Sequence[_Alarms]) -> _Alarms:
    raised = {name: np.concatenate([part.raised[name] for part in parts]) for name in parts[0].raised}
    checks = below_each_other([part.checks for part in parts])
    return _Alarms(COHORT, parts[0].kind, raised, checks, sum(part.refused for part in parts))


def _rows(alarms: _Alarms) -> Iterator[AlarmRow]:
    from scipy.stats import binomtest

    for name, raised in alarms.raised.items():
        interval = binomtest(int(raised.sum()), len(raised)).proportion_ci(CONFIDENCE, method="exact")
        yield AlarmRow(
            subject=alarms.subject,
            recordings=alarms.kind,
            alarm=name,
            rate=float(raised.mean()),
            ci_low=float(interval.low),
            ci_high=float(interval.high),
            n=len(raised),
            refused=alarms.refused,
            median_efficiency=float(np.median(alarms.checks.efficiency)),
        )
