"""What is wrong with a cohort: each problem with its place, its value and its remedy."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from swesbi.base.terminal import hidden_signs, printable

LONGEST_VALUE: Final = 60


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong, and what to do about it; the reason follows the value, where there is one.

    ``row`` is the line of a text file, or the number of an element, from 1; ``unit`` says which it counts.
    """

    file: str
    reason: str
    remedy: str
    row: int | None = None
    column: str | None = None
    value: str | None = None
    unit: str = "row"

    def __str__(self) -> str:
        place = [self.file]
        if self.row is not None:
            place.append(f"{self.unit} {self.row}")
        if self.column is not None:
            place.append(f"column {self.column!r}")
        value = self.value or ""
        value = value if len(value) <= LONGEST_VALUE else value[:LONGEST_VALUE] + "..."
        shown = "" if self.value is None else f"{value!r}{hidden_signs(value)} "
        return printable(f"{', '.join(place)}: {shown}{self.reason}; {self.remedy}")


class RecordingError(ValueError):
    """A recording or context table that cannot be used; the message lists every problem found."""

    def __init__(self, *problems: Problem) -> None:
        self.problems = problems
        super().__init__(listed(problems))


def refusal(
    file: Path | str,
    reason: str,
    remedy: str,
    row: int | None = None,
    column: str | None = None,
    value: str | None = None,
) -> RecordingError:
    """Return the refusal of a file for the one thing that is wrong with it."""
    return RecordingError(Problem(str(file), reason, remedy, row, column, value))


def listed(problems: Iterable[Problem]) -> str:
    """Return one problem as it is, or several as a list with their number."""
    lines = [str(problem) for problem in problems]
    if len(lines) == 1:
        return lines[0]
    return f"{len(lines)} problems\n" + "\n".join(f"  - {line}" for line in lines)


def raise_any(problems: Iterable[Problem]) -> None:
    """Raise a ``RecordingError`` if there is any problem."""
    if raised := tuple(problems):
        raise RecordingError(*raised)
