from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
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
from swesbi.parameters import THETA_NAMES


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
