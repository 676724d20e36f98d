"""The numbers that the paper prints, as the data file lists them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Self

import yaml
from pydantic import Field, TypeAdapter, ValidationError, model_validator

from swesbi.artefacts import ArtefactError
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
    measure: str
    of: dict[str, Option] = {}
    digits: int = Field(ge=0, le=8)
    reading: str
    remark: str = ""
    designed: str = ""
    statement: str = ""

    @model_validator(mode="before")
    @classmethod
    def _of_design(cls, plain: dict[str, Any]) -> dict[str, Any]:
        """Put what a ``path`` stands for: the measure of a study's design, and how it is read."""
        if "path" not in plain:
            return plain
        rest = {name: value for name, value in plain.items() if name != "path"}
        of = {**rest.get("of", {}), "path": plain["path"]}
        return {"measure": "designed", "reading": "configured", **rest, "of": of}

    @model_validator(mode="after")
    def _check_printed(self) -> Self:
        if bool(self.paper) == bool(self.cases):
            raise ValueError(f"{self.quantity}: give `paper` or `cases`, one of them")
        return self


class PaperGroup(Settings):
    """Rows that belong together, under a heading."""

    group: str = Field(min_length=1)
    rows: tuple[PaperRow, ...] = Field(min_length=1)


@dataclass(frozen=True)
class PaperNumber:
    """One number of the paper.

    Attributes:
        group: Heading of its rows.
        row: What it is, and how this study's value is found and read.
        case: The paper's case ("A"), empty for a number of the whole study.
        printed: As the paper prints it.
        value: The number; NaN where the print is words.
        sd: The standard deviation printed behind it; NaN where there is none.
    """

    group: str
    row: PaperRow
    case: str
    printed: str
    value: float
    sd: float

    def option(self, name: str) -> str:
        """Return an option of the measure that is a name.

        Raises:
            KeyError: The row has no such option.
        """
        return str(self.row.of[name])

    @property
    def quantity(self) -> str:
        """What the number is, its case and where the paper prints it."""
        case = f", case {self.case}" if self.case else ""
        return f"{self.row.quantity}{case} [{self.row.where}]"


def read_paper(path: Path = PAPER_VALUES) -> tuple[PaperNumber, ...]:
    """Read the paper's numbers, in the order of the file.

    Raises:
        ArtefactError: The file cannot be read, or a row is wrong.
    """
    try:
        plain = yaml.safe_load(path.read_text(encoding="utf-8"))
        groups = [PaperGroup.from_plain(part) for part in TypeAdapter(list[Any]).validate_python(plain)]
    except (OSError, yaml.YAMLError, ValidationError) as error:
        raise ArtefactError(f"{path}: cannot be read as the paper's numbers ({error})") from error
    return tuple(number for group in groups for row in group.rows for number in _expand(group.group, row))


def _expand(group: str, row: PaperRow) -> Iterator[PaperNumber]:
    for case, printed in (row.cases or {"": row.paper}).items():
        value, sd = numbers(printed)
        yield PaperNumber(group, row, case, printed, value if row.value is None else row.value, sd)


def numbers(printed: str) -> tuple[float, float]:
    """Return a printed number and the sd behind it: "12.61 ± 5.55", "120,000", ">0.99"; NaN for words."""
    values = [float(text) for text in NUMBER.findall(printed.replace(",", ""))]
    return (values[0] if values else float("nan")), (values[1] if "±" in printed else float("nan"))
