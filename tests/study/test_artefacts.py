"""Artefacts and the project's own tables: what is written is read back as it was, or refused."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from swesbi.artefacts import (
    Array,
    Artefact,
    ArtefactError,
    Group,
    Provenance,
    Variable,
    atomic_path,
    to_groups,
)
from swesbi.artefacts.csv import NAMES, read_csv, write_csv
from swesbi.parameters import THETA_NAMES
from swesbi.study.job import run_stage

LIKE_NUMBERS = ("NA", "nan", "None", "007", "1e3", "-1", "True", "", "inf", "+4 weeks")
ODD = ('a,"b"', "'", "-", "'-", "β")
FORMULAS = ("=1+1", "-1+1", "@x", "+x()", "'=1", "''@x")


@dataclass(frozen=True)
class Toy(Artefact, kind="toy"):
    speed_m_s: Annotated[NDArray[np.float64], Variable("phase", "m s-1", "speed")]


@dataclass(frozen=True)
class Columns(Artefact, kind="toy columns"):
    theta: Annotated[NDArray[np.float64], Variable("parameter", "1", "columns by position")]


def group(dims: str = "phase", units: str = "m s-1", name: str = "speed_m_s") -> dict[str, Group]:
    return {"/": Group({name: Array((dims,), np.array([1.0, np.nan, 3.0]), {"units": units})})}


def test_what_is_saved_is_read_back_with_its_provenance_and_not_as_another_kind(tmp_path: Path) -> None:
    path, origin = tmp_path / "new" / "toy.h5", Provenance("toy", "A", 7, {"b": 1.5, "a": [1, 2]}, "cafe")
    Toy.save(path, group(), origin)
    groups, provenance = Toy.load(path)
    np.testing.assert_array_equal(groups["/"]["speed_m_s"].values, [1.0, np.nan, 3.0])
    assert provenance == origin
    with pytest.raises(ArtefactError, match="holds a 'toy' artefact, expected 'toy columns'"):
        Columns.load(path)


def test_columns_of_theta_in_another_order_are_not_written(tmp_path: Path) -> None:
    columns, made = Columns(np.ones(3)), Provenance("toy columns")
    Columns.save(tmp_path / "right.h5", to_groups(columns, {"parameter": list(THETA_NAMES)}), made)
    with pytest.raises(ArtefactError, match=r"has parameters \['k_sr_per_s', .* expected \['k0_kpa', "):
        Columns.save(tmp_path / "toy.h5", to_groups(columns, {"parameter": list(THETA_NAMES[::-1])}), made)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (group(units="km/h"), "units"),
        (group(dims="time"), "dimensions"),
        (group(name="speed"), "lacks"),
    ],
)
def test_content_that_differs_from_its_schema_is_not_written(
    tmp_path: Path, wrong: dict[str, Group], message: str
) -> None:
    with pytest.raises(ArtefactError, match=message):
        Toy.save(tmp_path / "toy.h5", wrong, Provenance("toy"))
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("old")
    with pytest.raises(RuntimeError), atomic_path(path) as temporary:
        temporary.write_text("half")
        raise RuntimeError("interrupted")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "table.csv"


@pytest.mark.parametrize("column", [*NAMES, "reason"])
def test_names_are_read_as_they_were_written(path: Path, column: str) -> None:
    names = [*LIKE_NUMBERS, *ODD, *FORMULAS]
    for cells in (names, *([name] for name in names)):
        write_csv(path, pd.DataFrame({"number": 1.5, column: cells}))
        assert list(read_csv(path, ("reason",))[column]) == cells


def test_other_columns_hold_numbers_truth_values_or_texts(path: Path) -> None:
    table = pd.DataFrame(
        {"x": [-1.5, np.nan], "n": [7, -8], "is": [True, False], "word": ["NA", "b"], "none": [np.nan] * 2}
    )
    write_csv(path, table)
    pd.testing.assert_frame_equal(read_csv(path), table)


def test_no_text_of_a_table_is_a_formula(path: Path) -> None:
    written = (*FORMULAS, "-0.67 ± 0.03", "-1.5e-3", "+inf", "-0.05 (one subject)")
    write_csv(path, pd.DataFrame({"x": -1.5, "text": written}))
    cells = [line.split(",") for line in path.read_text(encoding="utf-8").splitlines()[1:]]
    assert {number for number, _ in cells} == {"-1.5"}
    assert [text for _, text in cells[: len(FORMULAS)]] == [f"'{text}" for text in FORMULAS]
    assert tuple(text for _, text in cells[len(FORMULAS) :]) == written[len(FORMULAS) :]


@dataclass(frozen=True)
class Said:
    """A result that writes itself."""

    text: str

    def write(self, path: Path, made: Provenance) -> None:
        path.write_text(self.text)


class SaidOnceOrTwice(NamedTuple):
    first: Said
    second: Said | None


def say(*, twice: bool) -> SaidOnceOrTwice:
    return SaidOnceOrTwice(Said("one"), Said("two") if twice else None)


@pytest.mark.parametrize("twice", [True, False])
def test_an_output_that_is_none_has_no_file_and_every_other_one_has(tmp_path: Path, *, twice: bool) -> None:
    params = {"twice": twice, "subject": "", "seed": 1, "code": "0"}
    every = {name: [tmp_path / name] for name in ("first", "second")}
    own, other = (every, {"first": every["first"]})[:: 1 if twice else -1]
    with pytest.raises(TypeError, match="the rule has the outputs"):
        run_stage(say, {}, other, params)
    assert not any(tmp_path.iterdir())
    run_stage(say, {}, own, params)
    assert {path.name for path in tmp_path.iterdir()} == set(own)
