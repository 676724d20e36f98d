"""Tables of other tools give the samples of their twin in this project's form, or are refused by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from cohorts import columns, recording
from scipy.io import savemat

from swesbi.recording.columns import SPEED
from swesbi.recording.layout import TableLayout, layout_of
from swesbi.recording.problems import RecordingError
from swesbi.recording.reader import read_samples
from swesbi.recording.samples import Samples

PHASES, DENSITY = 20, 1000.0
NAMES = {
    "phase_index": "Phase",
    "trigger_delay_ms": "Delay (s)",
    "rr_ms": "RR (s)",
    "repeat": "Acq",
    "sample": "ROI",
    SPEED: "SWS [cm/s]",
    "fit_r2": "Quality (%)",
    "status": "Flag",
}
LAYOUT: dict[str, Any] = {
    "columns": NAMES,
    "units": {"trigger_delay_ms": "s", "rr_ms": "s", SPEED: "cm/s", "fit_r2": "%"},
    "table": {"first_phase": 1, "statuses": {"good": "ok", "bad": "no_wave"}},
}
PLACE = Path("cohort/recording.yaml")


def as_others_write(table: pd.DataFrame) -> pd.DataFrame:
    """The same samples by other names, in cm/s and s, phases from 1."""
    other = table.copy()
    other["phase_index"] += 1
    for name in ("trigger_delay_ms", "rr_ms"):
        other[name] = (other[name] / 1000.0).round(6)
    other[SPEED] = (100.0 * other[SPEED]).round(6)
    other["fit_r2"] = (100.0 * other["fit_r2"]).round(6)
    other["status"] = other["status"].map(lambda word: "good" if word == "ok" else "bad")
    return other.rename(columns=NAMES)


def twin(table: pd.DataFrame, folder: Path) -> Samples:
    own = table.assign(status=table["status"].where(table["status"] == "ok", "no_wave"))
    own.to_csv(folder / "twin.csv", index=False)
    return read_samples(folder / "twin.csv", PHASES, DENSITY)


def assert_same(left: Samples, right: Samples) -> None:
    for name, mine in vars(left).items():
        if name != "source":
            np.testing.assert_array_equal(mine, getattr(right, name), err_msg=name)


def as_csv(table: pd.DataFrame, path: Path) -> Path:
    table.to_csv(path.with_suffix(".csv"), index=False)
    return path.with_suffix(".csv")


def as_german_csv(table: pd.DataFrame, path: Path) -> Path:
    table.to_csv(path.with_suffix(".csv"), index=False, sep=";", decimal=",")
    return path.with_suffix(".csv")


def as_workbook(table: pd.DataFrame, path: Path) -> Path:
    with pd.ExcelWriter(path.with_suffix(".xlsx")) as book:
        table.to_excel(book, index=False, sheet_name="speeds")
    return path.with_suffix(".xlsx")


@pytest.mark.parametrize("write", [as_csv, as_german_csv, as_workbook])
def test_other_names_units_and_numbers_give_the_samples_of_the_twin(
    tmp_path: Path, write: Callable[[pd.DataFrame, Path], Path]
) -> None:
    table = recording(phases=PHASES)
    path = write(as_others_write(table), tmp_path / "S")
    read = read_samples(path, PHASES, DENSITY, layout_of(LAYOUT, PLACE))
    assert_same(read, twin(table, tmp_path))


def test_a_matlab_file_of_other_names_is_read(tmp_path: Path) -> None:
    table = recording(phases=PHASES)
    names = {name: f"v{number}" for number, name in enumerate(NAMES)}
    savemat(tmp_path / "S.mat", {names[name]: values for name, values in columns(table).items()})
    read = read_samples(tmp_path / "S.mat", PHASES, DENSITY, layout_of({"columns": names}, PLACE))
    own = table.to_csv(tmp_path / "twin.csv", index=False)
    assert own is None
    assert_same(read, read_samples(tmp_path / "twin.csv", PHASES, DENSITY))


def wide() -> tuple[pd.DataFrame, pd.DataFrame]:
    """A table with a row a phase and repeat and a column a sample, and the long form of it."""
    long = recording(phases=PHASES).assign(status="ok", fit_r2=1.0)
    rows = ["phase_index", "repeat", "trigger_delay_ms", "rr_ms"]
    across = long.pivot_table(index=rows, columns="sample", values=SPEED, dropna=False, aggfunc="first")
    across = across.dropna(how="all").reset_index()
    kept = long.merge(across[rows], on=rows)
    return across.rename(columns=lambda name: f"ROI {name}" if isinstance(name, int) else name), kept


def test_a_column_a_sample_is_the_same_as_a_row_a_sample(tmp_path: Path) -> None:
    across, long = wide()
    across.to_csv(tmp_path / "S.csv", index=False)
    said = {"columns": {SPEED: "ROI *"}, "table": {"values": {"status": "ok", "fit_r2": 1}}}
    read = read_samples(tmp_path / "S.csv", PHASES, DENSITY, layout_of(said, PLACE))
    speeds = pd.Series(read.speed_m_s).groupby([read.phase_index, read.repeat]).mean()
    expected = long.groupby(["phase_index", "repeat"])[SPEED].mean()
    np.testing.assert_allclose(speeds.to_numpy(), expected.to_numpy())


def test_several_subjects_in_one_table_are_told_apart(tmp_path: Path) -> None:
    tables = {name: recording(seed=seed, phases=PHASES) for seed, name in enumerate(("S-1", "S-2"))}
    together = pd.concat([table.assign(Patient=name) for name, table in tables.items()])
    together.to_csv(tmp_path / "all.csv", index=False)
    layout = layout_of({"columns": {"subject": "Patient"}, "table": {"file": "all.csv"}}, PLACE)
    for name, table in tables.items():
        table.to_csv(tmp_path / "twin.csv", index=False)
        read = read_samples(tmp_path / "all.csv", PHASES, DENSITY, layout, name)
        assert_same(read, read_samples(tmp_path / "twin.csv", PHASES, DENSITY))
    with pytest.raises(RecordingError, match=r"column 'Patient': 'S-9' has no row; .* it has S-1, S-2"):
        read_samples(tmp_path / "all.csv", PHASES, DENSITY, layout, "S-9")


def test_a_shear_modulus_is_a_third_of_young_s(tmp_path: Path) -> None:
    table = recording(phases=PHASES)
    modulus = table.assign(mu=(1000.0 * DENSITY * table[SPEED] ** 2 / 1000.0)).drop(columns=SPEED)
    modulus.to_csv(tmp_path / "S.csv", index=False)
    said = {"columns": {"shear_modulus_kpa": "mu"}, "units": {"shear_modulus_kpa": "Pa"}}
    read = read_samples(tmp_path / "S.csv", PHASES, DENSITY, layout_of(said, PLACE))
    np.testing.assert_allclose(read.speed_m_s, table[SPEED], rtol=1e-12)


@pytest.mark.parametrize(
    ("column", "value", "words"),
    [
        (
            "SWS [cm/s]",
            "4e9",
            r"row 2, column 'SWS \[cm/s\]': '4e9' read in cm/s as shear_wave_speed_m_s is outside",
        ),
        ("SWS [cm/s]", "fast", r"column 'SWS \[cm/s\]': 'fast' read in cm/s .* is not a number"),
        ("Phase", "0", r"column 'Phase': '0' .*outside \[0, 19\]"),
        ("Flag", "so-so", "column 'Flag': 'so-so' is none of ok"),
        ("Acq", "1.5", "column 'Acq': '1.5' is not a whole number"),
    ],
)
def test_what_is_wrong_is_told_by_the_file_s_own_column_and_value(
    tmp_path: Path, column: str, value: str, words: str
) -> None:
    other = as_others_write(recording(phases=PHASES)).astype(object)
    other.loc[0, column] = value
    path = as_csv(other, tmp_path / "S")
    with pytest.raises(RecordingError, match=words) as refused:
        read_samples(path, PHASES, DENSITY, layout_of(LAYOUT, PLACE))
    assert str(path) in str(refused.value)


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ({"columns": {"speed": "SWS"}}, "`columns.speed` is for no column"),
        ({"columns": {"shear_wave_speed_se_m_s": "SE"}}, "means with standard errors are not taken"),
        ({"columns": {"repeat": ["a", "b"]}}, "`columns.repeat` names several columns"),
        ({"columns": {SPEED: "c", "youngs_modulus_kpa": "E"}}, "names shear_wave_speed_m_s and youngs"),
        ({"columns": "SWS"}, "`columns`"),
        (
            {"units": {SPEED: "km/h"}},
            "'km/h' under the key `units.shear_wave_speed_m_s` is not known; write m/s",
        ),
        ({"units": {"repeat": "1"}}, "`units.repeat` is of no column with a unit"),
        ({"table": {"file": "all.csv"}}, "no column says whose a row is"),
        ({"table": {"first_phase": 2}}, "`table.first_phase`"),
        ({"table": {"header_row": 0}}, "`table.header_row`"),
        ({"table": {"statuses": {"good": "fine"}}}, "'fine' under the key `table.statuses.good`"),
        ({"table": {"values": {"speed": 1}}}, "`table.values.speed` is for no column that the tables lack"),
        ({"table": {"values": {"repeat": "counted"}}}, "only phase_index and sample can be counted"),
        ({"table": {"values": {"phase_index": "counted", "sample": "counted"}}}, "cannot both be counted"),
    ],
)
def test_a_mapping_that_cannot_be_is_refused_by_its_key(said: dict[str, Any], words: str) -> None:
    with pytest.raises(RecordingError, match=words) as refused:
        layout_of(yaml.safe_load(yaml.safe_dump(said)), PLACE)
    assert str(PLACE) in str(refused.value)


def test_workbooks_that_cannot_be_read_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "S.xlsx"
    for content, words in ((b"", "cannot be read as a workbook"), (b"PK\x03\x04 no", "cannot be read")):
        path.write_bytes(content)
        with pytest.raises(RecordingError, match=words):
            read_samples(path, PHASES, DENSITY)
    table = recording(phases=PHASES).head(30)
    with pd.ExcelWriter(path) as book:
        table.to_excel(book, index=False, sheet_name="one")
        table.to_excel(book, index=False, sheet_name="two")
    with pytest.raises(RecordingError, match="has 2 sheets with rows: one, two; name the one that counts"):
        read_samples(path, PHASES, DENSITY)
    absent = TableLayout.from_plain({"table": {"sheet": "three"}})
    with pytest.raises(RecordingError, match="'three' is no sheet of the workbook, which has one, two"):
        read_samples(path, PHASES, DENSITY, absent)
    chosen = TableLayout.from_plain({"table": {"sheet": "two"}})
    assert len(read_samples(path, PHASES, DENSITY, chosen).status) == 30


def test_a_formula_without_a_value_is_no_failed_sample(tmp_path: Path) -> None:
    table = recording(phases=PHASES).head(30).astype({SPEED: object})
    table.loc[3, SPEED] = "=1+1"
    path = as_workbook(table, tmp_path / "S")
    with pytest.raises(RecordingError, match=r"row 5, .*'=1\+1' is a formula whose value was never computed"):
        read_samples(path, PHASES, DENSITY)


def test_columns_that_are_not_there_are_named(tmp_path: Path) -> None:
    path = as_csv(recording(phases=PHASES), tmp_path / "S")
    with pytest.raises(RecordingError, match="lacks the columns Phase, "):
        read_samples(path, PHASES, DENSITY, layout_of(LAYOUT, PLACE))
    several = layout_of({"columns": {SPEED: "ROI *"}}, PLACE)
    with pytest.raises(
        RecordingError, match=r"'ROI \*' stands for shear_wave_speed_m_s, and matches no column"
    ):
        read_samples(path, PHASES, DENSITY, several)
