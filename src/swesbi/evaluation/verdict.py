"""The verdict on one subject as figures and tables show it, whichever experiment gave it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from swesbi.artefacts import ArtefactError
from swesbi.evaluation.support_numbers import support_numbers
from swesbi.inference.support import Support, read_support

SUPPORTED: Final = "supported"
STRAINED: Final = "strained"
UNSUPPORTED: Final = "unsupported"
STATUSES: Final = (SUPPORTED, STRAINED, UNSUPPORTED)
NAN: Final = float("nan")


@dataclass(frozen=True)
class TestOutcome:
    """One test of whether the model can have made a recording.

    Attributes:
        name: Its name.
        statistic: The test statistic; NaN where there is none.
        p_value: Against its null distribution; NaN where there is none.
        threshold: What p-value or statistic was compared with; NaN where there is none.
        flagged: The test speaks against the model.
        detail: What it found, in words; may be empty.
    """

    __test__ = False  # not a test case of pytest

    name: str
    statistic: float
    p_value: float
    threshold: float
    flagged: bool
    detail: str


@dataclass(frozen=True)
class Verdict:
    """Support diagnostics of one subject with the tests behind them.

    Attributes:
        support: What every experiment has.
        status: supported, strained or unsupported; features know the first and the last.
        tests: Outcomes of the tests of an experiment on speeds; empty for one on features.
    """

    support: Support
    status: str
    tests: tuple[TestOutcome, ...]

    @property
    def answered(self) -> bool:
        """Whether a posterior is reported: not for a subject that is unsupported."""
        return self.status != UNSUPPORTED

    @property
    def flagged(self) -> tuple[TestOutcome, ...]:
        """The tests that speak against the model."""
        return tuple(test for test in self.tests if test.flagged)

    @property
    def numbers(self) -> tuple[str, ...]:
        """What decided, in a few short lines: flagged tests, or the two criteria of prior support."""
        if not self.tests:
            return support_numbers(self.support)
        return tuple(_short(test) for test in self.flagged)


def read_verdict(path: Path) -> Verdict:
    """Read ``support.json`` of any experiment.

    Raises:
        ArtefactError: The file is missing, or not such a file.
    """
    support = read_support(path)
    plain = json.loads(path.read_text(encoding="utf-8"))
    status = plain.get("status", SUPPORTED if support.supported else UNSUPPORTED)
    if status not in STATUSES:
        raise ArtefactError(f"{path}: status = {status!r} is none of {', '.join(STATUSES)}; delete it")
    try:
        return Verdict(support, status, tuple(map(_test, plain.get("tests", ()))))
    except (KeyError, TypeError, ValueError) as error:
        raise ArtefactError(f"{path}: its tests cannot be read ({error}); delete it") from error


def _test(plain: dict[str, Any]) -> TestOutcome:
    return TestOutcome(
        name=str(plain["name"]),
        statistic=_number(plain["statistic"]),
        p_value=_number(plain["p_value"]),
        threshold=_number(plain["threshold"]),
        flagged=bool(plain["flagged"]),
        detail=str(plain.get("detail") or ""),
    )


def _number(value: float | None) -> float:
    return NAN if value is None else float(value)


def _short(test: TestOutcome) -> str:
    name = test.name.replace("_", " ")
    if test.p_value != test.p_value:
        return name
    return f"{name}, p {'< 0.001' if test.p_value < 0.001 else f'= {test.p_value:.3f}'}"
