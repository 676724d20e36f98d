"""The numbers that the paper prints, as the data file lists them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

import yaml
from pydantic import Field, model_validator

from swesbi.base.settings import Settings

PAPER_VALUES: Final = Path(__file__).parent / "paper_values.yaml"
"""The data file that the package ships."""

FOUND: Final = "found"
DESIGNED: Final = "designed"
"""Where this study's value comes from: of the study, or of a choice that brought it about."""
NUMBER: Final = re.compile(r"[-+]?\d+(?:\.\d+)?")
Option = str | float | int | bool


class PaperRow(Settings):
    """One number of the paper, or one for each of its cases; the data file's head explains the fields."""

    quantity: str = Field(min_length=1)
    where: str = Field(min_length=1)
    paper: str = ""
    cases: dict[str, str] = {}
    value: float | None = None
    path: str = ""
    measure: str = "designed"
    of: dict[str, Option] = {}
    digits: int = Field(ge=0, le=8)
    reading: str = "configured"
    remark: str = ""
    designed: str = ""
    statement: str = ""

    @model_validator(mode="after")
    def _check_printed(self) -> Self:
        if bool(self.paper) == bool(self.cases):
            raise ValueError(f"{self.quantity}: give `paper` or `cases`, one of them")
        return self


@dataclass(frozen=True)
class PaperNumber:
    """One number of the paper; ``case`` is one of the paper's ("A"), empty for a number of the whole study.

    ``value`` is NaN where what is printed is words, ``sd`` where no standard deviation stands behind it.
    """

    row: PaperRow
    case: str
    printed: str
    value: float
    sd: float

    def option(self, name: str) -> str:
        """Return an option of the measure that is a name."""
        return str(self.row.of[name])

    @property
    def quantity(self) -> str:
        """What the number is, its case and where the paper prints it."""
        case = f", case {self.case}" if self.case else ""
        return f"{self.row.quantity}{case} [{self.row.where}]"


def read_paper() -> tuple[PaperNumber, ...]:
    """Read the paper's numbers, in the order of the file."""
    groups = yaml.safe_load(PAPER_VALUES.read_text(encoding="utf-8"))
    rows = [PaperRow.from_plain(plain) for group in groups for plain in group["rows"]]
    return tuple(
        PaperNumber(row, case, printed, value if row.value is None else row.value, sd)
        for row in rows
        for case, printed in (row.cases or {"": row.paper}).items()
        for value, sd in [numbers(printed)]
    )


def numbers(printed: str) -> tuple[float, float]:
    """Return a printed number and the sd behind it: "12.61 ± 5.55", "120,000", ">0.99"; NaN for words."""
    values = [float(text) for text in NUMBER.findall(printed.replace(",", ""))]
    return (values[0] if values else float("nan")), (values[1] if "±" in printed else float("nan"))
