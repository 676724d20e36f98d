"""The generated parts on the exam: of its own page, of the page on calibration and of the README."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

import pandas as pd

from swesbi.artefacts import ArtefactError
from swesbi.config.study import Study
from swesbi.show.numbers import as_percent
from swesbi.show.table import markdown
from swesbi.show.tables.exam import (
    exam_table,
    generators_table,
    noise_of,
    read_exam,
    read_samplers,
    samplers_table,
)
from swesbi.show.tables.exam_outcomes import in_brief

NOT_SAT: Final = "**The exam has not been sat yet**: `make exam` on a finished study."
STEMS: Final = ("exam", "exam_former_noise")
WHAT: Final = "The exam"
MARK: Final = "exam"
"""Name of the marked part, on each of the three pages."""


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
        former: At its former noise.
        interval: Mass of the credible intervals.
    """

    cohort: Sitting
    former: Sitting
    interval: float

    @classmethod
    def read(cls, folder: Path, interval: float) -> Self | None:
        """Read the stored tables; None before ``make exam``.

        Raises:
            ArtefactError: Some of the tables are there and others are not, or one is not what its name says.
        """
        paths = [folder / f"{stem}{suffix}.csv" for stem in STEMS for suffix in ("", "_samplers")]
        missing = [path for path in paths if not path.is_file()]
        if missing == paths:
            return None
        if missing:
            named = ", ".join(map(str, missing))
            raise ArtefactError(f"{named}: missing beside the other tables of the exam; run `make exam`")
        cohort, former = (_sitting(folder, stem) for stem in STEMS)
        return cls(cohort, former, interval)


def _sitting(folder: Path, stem: str) -> Sitting:
    return Sitting(stem, read_exam(folder / f"{stem}.csv"), read_samplers(folder / f"{stem}_samplers.csv"))


def exam_interval(study: Study) -> float:
    """Return the mass of the credible intervals of the exam."""
    base = study.config.base_of(study.config.exam.experiment)
    return study.config.speed_experiments[base].exact.interval


def page_part(results: ExamResults | None) -> str:
    """Show all of it at both levels of noise: what came out, figure, coverage, how it was answered."""
    if results is None:
        return NOT_SAT
    return "\n\n".join(
        f"**At {noise_of(sitting.table)}:**\n\n{_brief(sitting)}\n\n"
        f"![The exam at {noise_of(sitting.table)}](figures/{sitting.stem}.png)\n\n"
        f"{markdown(exam_table(sitting.table, WHAT))}\n\n{markdown(samplers_table(sitting.samplers, WHAT))}"
        for sitting in (results.cohort, results.former)
    )


def calibration_part(results: ExamResults | None) -> str:
    """Show what came out at both levels of noise, and coverage at the cohort's."""
    if results is None:
        return f"{NOT_SAT} [How it is set](exam.md)."
    former = results.former
    return (
        f"{_asked(results)}, as they are [examined](exam.md), at {noise_of(results.cohort.table)}:\n\n"
        f"{_brief(results.cohort)}\n\n{markdown(exam_table(results.cohort.table, WHAT))}\n\n"
        f"At {noise_of(former.table)} ([table](exam.md)):\n\n{_brief(former)}"
    )


def readme_part(results: ExamResults | None) -> str:
    """Show a row a generator at the cohort's noise."""
    if results is None:
        return f"{NOT_SAT} [How it is set](docs/exam.md)."
    return (
        f"{_asked(results)}, at {noise_of(results.cohort.table)}, worst first; [all of it](docs/exam.md).\n\n"
        f"{markdown(generators_table(results.cohort.table, WHAT))}"
    )


def _asked(results: ExamResults) -> str:
    return f"**Other people's hearts** in {as_percent(results.interval)} intervals"


def _brief(sitting: Sitting) -> str:
    return "\n".join(f"- {sentence}" for sentence in in_brief(sitting.table))
