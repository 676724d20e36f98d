"""The generated parts on the exam: of its own page and of the page on calibration."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

import pandas as pd

from swesbi.artefacts import ArtefactError
from swesbi.exam.settings import FORMER_NOISE
from swesbi.show.numbers import as_percent
from swesbi.show.table import markdown
from swesbi.show.tables.exam import (
    NOISE,
    exam_table,
    generators_table,
    noise_of,
    pressures_table,
    read_exam,
    read_samplers,
    samplers_table,
    sittings_table,
)
from swesbi.show.tables.exam_outcomes import in_brief, with_pressures_in_brief

NOT_SAT: Final = "**The exam has not been sat yet**: `make exam` on a finished study."
NOT_SAT_AT_FORMER: Final = f"At {NOISE[FORMER_NOISE]} the exam has not been sat yet."
NOT_SAT_WITH_PRESSURES: Final = (
    "With cuff pressures the exam has not been sat yet: `python -m swesbi exam --pressures`."
)
SAT_ONCE: Final = "The exam has been sat once at most."
STEMS: Final = ("exam", "exam_former_noise", "exam_pressures")
SITTING_TABLES: Final = ("exam_sitting_1", "exam_sitting_2")
"""Names of the tables of both sittings at the cohort's noise; the second may have fewer generators."""
WHAT: Final = "The exam"
MARK: Final = "exam"
"""Name of the marked part, on each of the three pages."""
SITTINGS: Final = "sittings"
"""Name of the marked part on the sittings, on the exam's own page."""


@dataclass(frozen=True)
class Sitting:
    """The exam at one level of noise.

    Attributes:
        stem: Name of its table and of its figure, without the suffix.
        table: ``exam.csv``.
        samplers: ``exam_samplers.csv``.
    """

    stem: str
    table: pd.DataFrame
    samplers: pd.DataFrame


@dataclass(frozen=True)
class ExamResults:
    """The exam as it was sat, at each level of noise.

    Attributes:
        cohort: At the noise of the cohort.
        former: At its former noise; None where it has been sat at the cohort's alone.
        pressures: At the cohort's noise, from speeds and cuff pressures; None where it has not been sat so.
        sittings: The tables of the first and of the second sitting; None where there was but one.
        interval: Mass of the credible intervals.
    """

    cohort: Sitting
    former: Sitting | None
    pressures: Sitting | None
    sittings: tuple[pd.DataFrame, pd.DataFrame] | None
    interval: float

    @classmethod
    def read(cls, folder: Path, interval: float) -> Self | None:
        """Read the stored tables; None before ``make exam``.

        Raises:
            ArtefactError: Of a level of noise one table is there and the other is not, the cohort's level is
                missing, or a table is not what its name says.
        """
        found = [_sitting(folder, stem) for stem in STEMS]
        there = [stem for stem, sitting in zip(STEMS, found, strict=True) if sitting]
        if not there:
            return None
        cohort, former, pressures = found
        if cohort is None:
            raise ArtefactError(f"{folder / STEMS[0]}.csv: missing beside {there[0]}.csv; run `make exam`")
        return cls(cohort, former, pressures, _both_sittings(folder), interval)


def _both_sittings(folder: Path) -> tuple[pd.DataFrame, pd.DataFrame] | None:
    first, second = (folder / f"{name}.csv" for name in SITTING_TABLES)
    return (read_exam(first), read_exam(second)) if first.is_file() and second.is_file() else None


def _sitting(folder: Path, stem: str) -> Sitting | None:
    """Read both tables of one level of noise; None where neither is there."""
    paths = [folder / f"{stem}{suffix}.csv" for suffix in ("", "_samplers")]
    missing = [str(path) for path in paths if not path.is_file()]
    if len(missing) == len(paths):
        return None
    if missing:
        raise ArtefactError(f"{missing[0]}: missing beside the other table of the exam; run `make exam`")
    return Sitting(stem, read_exam(paths[0]), read_samplers(paths[1]))


def page_part(results: ExamResults | None) -> str:
    """Show all of it at both levels of noise: what came out, figure, coverage, how it was answered."""
    if results is None:
        return NOT_SAT
    sittings = [sitting for sitting in (results.cohort, results.former) if sitting is not None]
    parts = [
        f"**At {noise_of(sitting.table)}:**\n\n{_brief(sitting)}\n\n"
        f"{markdown(generators_table(sitting.table, WHAT))}\n\n"
        f"![The exam at {noise_of(sitting.table)}](figures/{sitting.stem}.png)\n\n"
        f"{markdown(exam_table(sitting.table, WHAT))}\n\n{markdown(samplers_table(sitting.samplers, WHAT))}"
        for sitting in sittings
    ]
    at_former = [] if results.former else [NOT_SAT_AT_FORMER]
    return "\n\n".join([*parts, *at_former, *_with_pressures(results)])


def _with_pressures(results: ExamResults) -> Iterator[str]:
    """Yield what stands on cuff pressures: what they change, figure, coverage and width, samplers."""
    if results.pressures is None:
        yield NOT_SAT_WITH_PRESSURES
        return
    informed = results.pressures
    yield "**With cuff pressures**, the verdicts being those of the speeds alone:"
    yield "\n".join(f"- {each}" for each in with_pressures_in_brief(results.cohort.table, informed.table))
    yield f"![The exam with cuff pressures](figures/{informed.stem}.png)"
    yield markdown(pressures_table(results.cohort.table, informed.table, WHAT))
    yield markdown(samplers_table(informed.samplers, f"{WHAT} with cuff pressures"))


def sittings_part(results: ExamResults | None) -> str:
    """Show both sittings beside each other."""
    if results is None or results.sittings is None:
        return SAT_ONCE
    first, second = results.sittings
    return markdown(sittings_table(first, second, WHAT))


def calibration_part(results: ExamResults | None) -> str:
    """Show what came out at both levels of noise, and coverage at the cohort's."""
    if results is None:
        return f"{NOT_SAT} [How it is set](exam.md)."
    former = results.former
    at_former = (
        f"At {noise_of(former.table)} ([table](exam.md)):\n\n{_brief(former)}"
        if former
        else NOT_SAT_AT_FORMER
    )
    return (
        f"{_asked(results)}, as they are [examined](exam.md), at {noise_of(results.cohort.table)}:\n\n"
        f"{_brief(results.cohort)}\n\n{markdown(exam_table(results.cohort.table, WHAT))}\n\n"
        f"{at_former}"
    )


def _asked(results: ExamResults) -> str:
    return f"**Other people's hearts** in {as_percent(results.interval)} intervals"


def _brief(sitting: Sitting) -> str:
    return "\n".join(f"- {sentence}" for sentence in in_brief(sitting.table))
