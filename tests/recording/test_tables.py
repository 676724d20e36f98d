"""A recording is the same whatever table it comes in: format, dialect, names, units, shape, order of rows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import free_case
import h5py
import numpy as np
import pandas as pd
import pytest
from cohorts import columns, recording, write_v5, write_v73
from numpy.typing import NDArray
from recordings import CONTEXT, DENSITY, PHASES, RECORDING, make_samples
from scipy.io import savemat

from data.makers.files import samples_table
from swesbi.recording.cohort.recording_file import validated
from swesbi.recording.ingest import ingest
from swesbi.recording.problems import RecordingError
from swesbi.recording.reader import read_samples
from swesbi.recording.samples import Samples
from swesbi.recording.tables.layout import MODULUS, SHEAR_MODULUS, SPEED, TIME, TableLayout, stated_unit

Write = Callable[[Path, pd.DataFrame], None]
KEYS = ["phase_index", "repeat", "trigger_delay_ms", "rr_ms"]
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
TRANSLATION: dict[str, Any] = {
    "columns": NAMES,
    "table": {"first_phase": 1, "statuses": {"good": "ok", "bad": "no_wave"}},
}


def read(path: Path, said: Mapping[str, Any] | None = None, subject: str = "") -> Samples:
    return read_samples(path, PHASES, DENSITY, validated(TableLayout, said or {}, path), subject)


def assert_reads_as(
    path: Path, table: pd.DataFrame, said: Mapping[str, Any] | None = None, subject: str = ""
) -> None:
    """A file is read as the plain CSV of a table is, to the last digit."""
    twin = path.with_name("twin.csv")
    table.to_csv(twin, index=False)
    right = vars(read(twin))
    for name, mine in vars(read(path, said, subject)).items():
        if isinstance(mine, np.ndarray):
            np.testing.assert_array_equal(mine, right[name], err_msg=name)


def text(path: Path, table: pd.DataFrame, encoding: str = "utf-8", before: str = "", **how: str) -> None:
    path.write_text(before + table.to_csv(index=False, **how), encoding=encoding)


def commented(path: Path, table: pd.DataFrame) -> None:
    first, *lines = table.to_csv(index=False).splitlines()
    path.write_text("\n".join(["# scanner 2", "#", first, "# one more, with a , in it", *lines, "", ""]))


def char_matrix(path: Path, table: pd.DataFrame) -> None:
    savemat(
        path,
        columns(table)
        | {"status": np.array(list(table["status"])), "other": "kept out", "image": np.ones((9, 9))},
    )


def array_of_structs(path: Path, table: pd.DataFrame) -> None:
    """What table2struct(T) writes without 'ToScalar': one struct a row."""
    rows = [tuple(row) for row in table.itertuples(index=False)]
    savemat(path, {"T": np.array(rows, dtype=[(name, object) for name in table])})


def by_h5py(path: Path, table: pd.DataFrame) -> None:
    """HDF5 without the marks of MATLAB: plain vectors, and texts of any length."""
    with h5py.File(path, "w") as file:
        for name in table:
            file[name] = list(table[name]) if name == "status" else table[name].to_numpy(dtype=float)


WRITERS: dict[str, tuple[str, Write]] = {
    "semicolon": (".csv", lambda path, table: text(path, table, sep=";")),
    "semicolon, decimal comma": (".CSV", lambda path, table: text(path, table, sep=";", decimal=",")),
    "tab, decimal comma": (".tsv", lambda path, table: text(path, table, sep="\t", decimal=",")),
    "text file": (".txt", lambda path, table: text(path, table, sep="\t")),
    "byte order mark": (".csv", lambda path, table: text(path, table, "utf-8-sig", sep=";", decimal=",")),
    "Windows line ends": (".csv", lambda path, table: text(path, table, lineterminator="\r\n")),
    "old Macintosh line ends": (".csv", lambda path, table: text(path, table, lineterminator="\r")),
    "NaN for empty": (".csv", lambda path, table: text(path, table, na_rep="NaN")),
    "comments": (".csv", commented),
    "names behind #": (".csv", lambda path, table: text(path, table, before="# ")),
    "sep=": (".csv", lambda path, table: text(path, table, before="sep=;\n", sep=";")),
    "columns in another order, and more": (
        ".csv",
        lambda path, table: text(path, table.iloc[:, ::-1].assign(operator="x;y")),
    ),
    "rows in another order": (".csv", lambda path, table: text(path, table.sample(frac=1.0, random_state=1))),
    "index of pandas": (".csv", lambda path, table: table.to_csv(path)),
    "workbook": (".xlsx", lambda path, table: table.to_excel(path, index=False)),
    "MATLAB 5, vectors": (".mat", write_v5),
    "MATLAB 5, row vectors": (
        ".mat",
        lambda path, table: savemat(path, {name: value.T for name, value in columns(table).items()}),
    ),
    "MATLAB 5, struct": (".mat", lambda path, table: write_v5(path, table, "rec")),
    "MATLAB 5, char matrix": (".mat", char_matrix),
    "MATLAB 5, array of structs": (".mat", array_of_structs),
    "MATLAB 7.3, vectors": (".mat", write_v73),
    "MATLAB 7.3, struct": (".mat", lambda path, table: write_v73(path, table, "rec")),
    "HDF5 by h5py": (".mat", by_h5py),
}


@pytest.mark.parametrize("form", WRITERS)
def test_every_format_gives_the_samples_of_its_twin_in_csv(tmp_path: Path, form: str) -> None:
    table = recording()
    suffix, write = WRITERS[form]
    write(tmp_path / f"S{suffix}", table)
    assert_reads_as(tmp_path / f"S{suffix}", table)


@pytest.mark.parametrize("kind", ["f4", "i1", "u4", "i8"])
def test_numbers_of_every_class_of_matlab(tmp_path: Path, kind: str) -> None:
    table = columns(recording())
    values: NDArray[Any] = table["sample"].astype(kind).astype(float)
    savemat(tmp_path / "S.mat", table | {"sample": table["sample"].astype(kind), "sweeps": 3.0})
    np.testing.assert_array_equal(np.sort(read(tmp_path / "S.mat").sample), np.sort(values.ravel()))


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


@pytest.mark.parametrize("form", ["semicolon, decimal comma", "workbook"])
def test_other_names_units_and_numbers_give_the_samples_of_the_twin(tmp_path: Path, form: str) -> None:
    table = recording()
    suffix, write = WRITERS[form]
    write(tmp_path / f"S{suffix}", as_others_write(table))
    assert_reads_as(tmp_path / f"S{suffix}", table, TRANSLATION)


def test_a_matlab_file_of_other_names_is_read(tmp_path: Path) -> None:
    table = recording()
    names = {name: f"v{number}" for number, name in enumerate(NAMES)}
    savemat(tmp_path / "S.mat", {names[name]: values for name, values in columns(table).items()})
    assert_reads_as(tmp_path / "S.mat", table, {"columns": names})


def wide(table: pd.DataFrame, *values: str) -> pd.DataFrame:
    """A row a phase and repeat; of each sample a column of each of these values, in an order of their own."""
    parts = [
        table.pivot_table(index=KEYS, columns="sample", values=name, dropna=False, aggfunc="first")
        .dropna(how="all")
        .rename(columns=f"{name} {{}}".format)
        for name in values
    ]
    parts[0] = parts[0][sorted(parts[0])]  # as text: 1, 10, 11, 2
    return pd.concat(parts, axis=1).reset_index()


def test_samples_side_by_side_are_paired_by_their_names(tmp_path: Path) -> None:
    table = recording().assign(status="ok", fit_r2=lambda made: 0.01 * (made["sample"] + 70))
    wide(table, SPEED, "fit_r2").to_csv(tmp_path / "S.csv", index=False)
    pairs = [{name: f"{name} {number}" for name in (SPEED, "fit_r2")} for number in set(table["sample"])]
    said = {"samples": pairs, "values": {"status": "ok"}}
    assert_reads_as(tmp_path / "S.csv", table, {"table": said})
    said["values"] = {"status": "ok", "phase_index": "counted"}
    ordered = wide(table, SPEED, "fit_r2").sort_values(["repeat", "trigger_delay_ms"])
    ordered.drop(columns="phase_index").to_csv(tmp_path / "T.csv", index=False)
    assert_reads_as(tmp_path / "T.csv", table, {"table": said})


def test_several_subjects_in_one_table_are_told_apart(tmp_path: Path) -> None:
    tables = {name: recording(seed=seed) for seed, name in enumerate(("S-1", "S-11"))}
    together = pd.concat([table.assign(Patient=name) for name, table in tables.items()])
    together.to_csv(tmp_path / "all.csv", index=False)
    said = {"columns": {"subject": "Patient"}, "table": {"file": "all.csv"}}
    for name, table in tables.items():
        assert_reads_as(tmp_path / "all.csv", table, said, name)
    with pytest.raises(RecordingError, match=r"column 'Patient': 'S-9' has no row; .* it has S-1, S-11"):
        read(tmp_path / "all.csv", said, "S-9")


@pytest.mark.parametrize("spelled", ["s-1", "S-01", "S 1", ""])
def test_rows_that_may_be_a_subjects_are_refused(tmp_path: Path, spelled: str) -> None:
    names = ["S-1", spelled]
    parts = [recording(seed).assign(Patient=name) for seed, name in enumerate(names)]
    pd.concat(parts).to_csv(tmp_path / "all.csv", index=False)
    said = {"columns": {"subject": "Patient"}, "table": {"file": "all.csv"}}
    why = "has no name" if not spelled else "differs from S-1 in case, zeros, blanks or signs only"
    with pytest.raises(RecordingError, match=why):
        read(tmp_path / "all.csv", said, "S-1")


@pytest.mark.parametrize("density", [1000.0, 1060.0])
def test_a_modulus_becomes_a_speed_sample_by_sample(tmp_path: Path, density: float) -> None:
    table = recording()
    speed = table.pop(SPEED)
    table.assign(**{MODULUS: 3.0 * density * speed**2 / 1e3}).to_csv(tmp_path / "S.csv", index=False)
    found = read_samples(tmp_path / "S.csv", PHASES, density)
    np.testing.assert_allclose(found.speed_m_s, speed, rtol=1e-14)
    other = table.assign(mu=1000.0 * density * speed**2 / 1e3, rr_ms=table["rr_ms"] / 1000.0)
    other.to_csv(tmp_path / "T.csv", index=False)
    said = {"columns": {SHEAR_MODULUS: "mu"}, "units": {SHEAR_MODULUS: "Pa", "rr_ms": "s"}}
    shear = read_samples(tmp_path / "T.csv", PHASES, density, validated(TableLayout, said, tmp_path))
    np.testing.assert_allclose(shear.speed_m_s, speed, rtol=1e-12)
    np.testing.assert_allclose(shear.rr_ms, table["rr_ms"])


@pytest.mark.parametrize("phases", [8, 37])
def test_recordings_of_other_numbers_of_phases_in_any_order(tmp_path: Path, phases: int) -> None:
    table = recording(phases=phases)
    order = np.random.default_rng(1).permutation(phases)
    shuffled = table.assign(phase_index=order[table["phase_index"]]).sample(frac=1.0, random_state=2)
    settings = RECORDING.model_copy(update={"phases": phases})
    curves = []
    for form in (table, shuffled):
        form.to_csv(tmp_path / "S.csv", index=False)
        samples = read_samples(tmp_path / "S.csv", phases, DENSITY)
        curves.append(ingest(samples, CONTEXT, settings, 100).curve_kpa)
    np.testing.assert_allclose(curves[1], curves[0], rtol=1e-12)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("SWS (m/s)", "m/s"), ("SWS [cm s^-1]", "cm/s"), ("speed_m_s", "m/s"), ("Delay (msec)", "ms"),
        ("Time (% RR)", "%"), ("E (kPa)", "kPa"), ("c_s", None), ("T", None), ("rr ms", "ms"),
        ("Stiffness", None), ("SWS (septum)", None),
    ],
)  # fmt: skip
def test_the_unit_that_a_name_states(name: str, unit: str | None) -> None:
    assert stated_unit(name) == unit


@pytest.mark.parametrize("unit", ["%", "kPa", "cm/s"])
def test_standard_errors_are_converted(tmp_path: Path, unit: str) -> None:
    """10 % of a speed, 30 cm/s of 3 m/s, and of E = 3 rho c^2 in kPa what is 10 % of c: 20 %."""
    train = free_case.train(2)
    speed = train[SPEED]
    errors = {"%": 10.0 + 0.0 * speed, "kPa": 0.2 * 3.0 * speed**2, "cm/s": 10.0 * speed}[unit]
    train.assign(**{f"SE ({unit})": errors}).to_csv(tmp_path / "S.csv", index=False)
    layout = validated(TableLayout, {"columns": {"se_m_s": f"SE ({unit})"}}, tmp_path)
    samples = free_case.pushes(tmp_path / "S.csv", layout)
    np.testing.assert_allclose(samples.se_m_s, 0.1 * samples.speed_m_s, rtol=1e-9)


@pytest.mark.parametrize(
    ("name", "said", "factor"),
    [(TIME, {"units": {TIME: "ms"}}, 1.0), ("t_ms", {}, 1.0), ("Time (s)", {}, 0.001)],
)
def test_pushes_soon_after_the_r_peak_are_read_where_their_unit_is_stated(
    tmp_path: Path, name: str, said: dict[str, object], factor: float
) -> None:
    soon = free_case.train(2)
    soon[TIME] *= 0.1
    other = soon.assign(time_ms=factor * soon[TIME]).rename(columns={TIME: name})
    other.to_csv(tmp_path / "S.csv", index=False)
    mapped = {} if name == TIME else {"columns": {TIME: name}}
    found = free_case.pushes(tmp_path / "S.csv", validated(TableLayout, {**mapped, **said}, tmp_path))
    assert 5.0 < found.time_ms.max() < 110.0
    assert set(np.round(found.time_ms, 6)) <= set(np.round(soon[TIME], 6))
    soon.to_csv(tmp_path / "S.csv", index=False)
    with pytest.raises(RecordingError, match=r"say `units: \{ time_ms: ms \}` in recording.yaml"):
        free_case.observed(tmp_path / "S.csv")


@pytest.mark.parametrize(
    ("column", "value", "words"),
    [
        ("SWS [cm/s]", "4e9", r"'SWS \[cm/s\]': '4e9' read in cm/s as shear_wave_speed_m_s is outside"),
        ("Phase", "0", r"'Phase': '0' .*outside \[0, 19\]"),
        ("Flag", "so-so", "'Flag': 'so-so' is none of ok"),
    ],
)
def test_what_is_wrong_is_told_by_the_file_s_own_column_and_value(
    tmp_path: Path, column: str, value: str, words: str
) -> None:
    other = as_others_write(recording()).astype(object)
    other.loc[0, column] = value
    other.to_csv(tmp_path / "S.csv", index=False)
    with pytest.raises(RecordingError, match=f"S.csv, row 2, column {words}"):
        read(tmp_path / "S.csv", TRANSLATION)


@pytest.mark.slow
def test_a_million_rows_are_read(tmp_path: Path) -> None:
    samples = make_samples(sample_sd=0.05, per_repeat=16_667)
    samples_table(samples).to_csv(tmp_path / "S.csv", index=False)
    found = read(tmp_path / "S.csv")
    assert len(found.status) > 1_000_000
    np.testing.assert_array_equal(found.speed_m_s, samples.speed_m_s)
