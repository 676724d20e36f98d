"""Kinds of files that people have: each is read rightly, or refused by row or column."""

from __future__ import annotations

from pathlib import Path

import free_case
import numpy as np
import pandas as pd
import pytest
from cohorts import recording
from openpyxl import Workbook

from swesbi.recording.columns import MODULUS, SHEAR_MODULUS, SPEED
from swesbi.recording.free_samples import read_free_samples
from swesbi.recording.layout import TableLayout, layout_of
from swesbi.recording.phases import locate_phases
from swesbi.recording.problems import RecordingError
from swesbi.recording.propose import proposal_for, propose
from swesbi.recording.quality import rejection
from swesbi.recording.reader import read_samples
from swesbi.recording.samples import ACCEPTED, Samples
from swesbi.recording.speed import average_speeds
from swesbi.recording.units import stated_unit

QUALITY = free_case.QUALITY


def read(path: Path, table: pd.DataFrame, said: dict[str, object] | None = None) -> Samples:
    table.to_csv(path, index=False)
    return read_samples(path, 20, 1000.0, layout_of(said or {}, path))


def test_a_gate_at_the_r_peak_lies_on_both_sides_of_it(tmp_path: Path) -> None:
    """Half of the rows of phase 0 precede the R peak: the mean of 0.99 and 0.01 is 0, and no half beat."""
    table = recording(3).assign(rr_ms=1000)
    table["trigger_delay_ms"] = (50 * table["phase_index"] + 8 * (table["repeat"] - 1)) % 1000
    samples = read(tmp_path / "S.csv", table)
    accepted = rejection(samples, QUALITY) == ACCEPTED
    speeds = average_speeds(samples, accepted, 20)
    located = locate_phases(samples, speeds.beat_phase, np.ones(len(table), dtype=np.bool_))
    np.testing.assert_allclose((located + 0.02) % 1.0, np.arange(20) / 20 + 0.02, atol=0.004)
    without = read(tmp_path / "T.csv", table.assign(trigger_delay_ms=50 * table["phase_index"] + 20))
    noise = average_speeds(without, rejection(without, QUALITY) == ACCEPTED, 20).noise
    assert speeds.noise.repeat_fraction == pytest.approx(noise.repeat_fraction, abs=0.03)


def test_a_label_that_contradicts_its_time_is_refused_by_row(tmp_path: Path) -> None:
    table = recording(4)
    moved = table["repeat"] == 1
    table.loc[moved, "phase_index"] = (table.loc[moved, "phase_index"] + 1) % 20
    with pytest.raises(
        RecordingError, match=r"S.csv, row 1\d, column 'trigger_delay_ms': .*about a gate from"
    ):
        read(tmp_path / "S.csv", table)


def test_rows_repeat_each_other_by_value(tmp_path: Path) -> None:
    table = recording(5).astype({"repeat": object})
    again = table.iloc[[7]].assign(repeat=lambda row: row["repeat"].map("{}.0".format))
    with pytest.raises(RecordingError, match="repeats the phase_index, repeat, sample of an earlier row"):
        read(tmp_path / "S.csv", pd.concat([table, again]))


def test_the_order_of_rows_enters_no_digit(tmp_path: Path) -> None:
    table = recording(6)
    one, other = (read(tmp_path / "S.csv", part) for part in (table, table.sample(frac=1.0, random_state=1)))
    for name, values in vars(one).items():
        np.testing.assert_array_equal(values, vars(other)[name])


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


def test_a_stated_unit_is_read_and_a_contradiction_refused(tmp_path: Path) -> None:
    table = recording(7)
    other = table.assign(**{SPEED: (100.0 * table[SPEED]).round(6)}).rename(columns={SPEED: "SWS (cm/s)"})
    mapped: dict[str, object] = {"columns": {SPEED: "SWS (cm/s)"}}
    np.testing.assert_allclose(read(tmp_path / "S.csv", other, mapped).speed_m_s, table[SPEED], rtol=1e-12)
    with pytest.raises(RecordingError, match=r"states cm/s, and `units.shear_wave_speed_m_s` .* is mm/s"):
        read(tmp_path / "S.csv", other, mapped | {"units": {SPEED: "mm/s"}})
    kpa = table.rename(columns={SPEED: "SWS (kPa)"})
    with pytest.raises(RecordingError, match="states kPa, and shear_wave_speed_m_s is read in m/s"):
        read(tmp_path / "S.csv", kpa, {"columns": {SPEED: "SWS (kPa)"}})


def test_a_column_of_ones_own_name_keeps_its_meaning(tmp_path: Path) -> None:
    table = recording(8)
    modulus = table.assign(**{MODULUS: 3.0 * table[SPEED] ** 2, "rr_ms": table["rr_ms"] / 1000.0})
    samples = read(tmp_path / "S.csv", modulus.drop(columns=SPEED), {"units": {"rr_ms": "s"}})
    np.testing.assert_allclose(samples.speed_m_s, table[SPEED], rtol=1e-12)
    np.testing.assert_allclose(samples.rr_ms, table["rr_ms"])


@pytest.mark.parametrize(("unit", "factor"), [("%", 10.0), ("kPa", None), ("cm/s", 30.0)])
def test_standard_errors_are_converted(tmp_path: Path, unit: str, factor: float | None) -> None:
    """10 % of a speed, 30 cm/s of 3 m/s, and of E = 3 rho c^2 in kPa what is 10 % of c: 20 %."""
    train = free_case.train(2)
    speed = train[SPEED]
    errors = {"%": 10.0 + 0.0 * speed, "kPa": 0.2 * 3.0 * speed**2, "cm/s": 10.0 * speed}[unit]
    train.assign(**{f"SE ({unit})": errors}).to_csv(tmp_path / "S.csv", index=False)
    layout = layout_of({"columns": {"se_m_s": f"SE ({unit})"}}, tmp_path / "recording.yaml")
    samples = read_free_samples(tmp_path / "S.csv", 1000.0, layout)
    np.testing.assert_allclose(samples.se_m_s, 0.1 * samples.speed_m_s, rtol=1e-9)


@pytest.mark.parametrize("stated", [True, False])
def test_instants_in_per_cent_of_the_beat_are_refused(tmp_path: Path, stated: bool) -> None:
    train = free_case.train(2)
    train["time_ms"] = (100.0 * train["time_ms"] / train["rr_ms"]).round(1)
    name = "Time (% RR)" if stated else "time_ms"
    train.rename(columns={"time_ms": name}).to_csv(tmp_path / "S.csv", index=False)
    layout = layout_of({"columns": {"time_ms": name}} if stated else {}, tmp_path / "recording.yaml")
    with pytest.raises(
        RecordingError, match="states %, and time_ms is read in ms, s|can be per cent of the beat"
    ):
        free_case.observed(tmp_path / "S.csv", layout)


@pytest.mark.parametrize(
    ("name", "said", "factor"),
    [("time_ms", {"units": {"time_ms": "ms"}}, 1.0), ("t_ms", {}, 1.0), ("Time (s)", {}, 0.001)],
)
def test_pushes_soon_after_the_r_peak_are_read_where_their_unit_is_stated(
    tmp_path: Path, name: str, said: dict[str, object], factor: float
) -> None:
    train = free_case.train(2)
    soon = train.assign(time_ms=0.1 * train["time_ms"])
    soon.assign(time_ms=factor * soon["time_ms"]).rename(columns={"time_ms": name}).to_csv(
        tmp_path / "S.csv", index=False
    )
    columns = {} if name == "time_ms" else {"columns": {"time_ms": name}}
    layout = layout_of({**columns, **said}, tmp_path / "recording.yaml")
    found = free_case.observed(tmp_path / "S.csv", layout)
    assert 5.0 < found.time_ms.max() < 110.0
    assert set(np.round(found.time_ms, 6)) <= set(np.round(soon["time_ms"], 6))
    soon.to_csv(tmp_path / "S.csv", index=False)
    with pytest.raises(RecordingError, match=r"say `units: \{ time_ms: ms \}` in recording.yaml"):
        free_case.observed(tmp_path / "S.csv")


def test_a_speed_goes_before_a_modulus_and_nobody_guesses_which_modulus() -> None:
    gated = ["Phase", "Delay (ms)", "RR (ms)", "Acq", "ROI"]
    assert propose([*gated, "Stiffness (kPa)", "SWS (m/s)"]).columns[SPEED] == "SWS (m/s)"
    assert propose([*gated, "Stiffness (m/s)"]).columns[SPEED] == "Stiffness (m/s)"
    asked = propose([*gated, "Stiffness (kPa)"])
    assert asked.either == ("Stiffness (kPa)",)
    assert not {SPEED, MODULUS, SHEAR_MODULUS} & set(asked.columns)
    assert propose([*gated, "Young's modulus (kPa)"]).columns[MODULUS] == "Young's modulus (kPa)"


def test_a_proposal_takes_no_column_that_it_calls_unused() -> None:
    proposal = propose(["Phase", "SWS 1", "SWS 2", "SWS 3", "SWS mean"])
    assert proposal.columns[SPEED] == ("SWS 1", "SWS 2", "SWS 3")
    assert "SWS mean" in proposal.unused


def shared(path: Path, names: list[str]) -> TableLayout:
    """A table of two subjects, the second recording under these names by turns."""
    own, other = recording(1).assign(patient="P01"), recording(2)
    other["patient"] = [names[row % len(names)] for row in range(len(other))]
    pd.concat([own, other]).to_csv(path, index=False)
    said = {"columns": {"subject": "patient"}, "table": {"file": path.name}}
    return layout_of(said, path)


@pytest.mark.parametrize("spelled", ["p01", "P1", "P-01", "P 01", ""])
def test_rows_that_may_be_a_subjects_are_refused(tmp_path: Path, spelled: str) -> None:
    layout = shared(tmp_path / "all.csv", [spelled])
    why = "has no name" if not spelled else "differs from P01 in case, zeros, blanks or signs only"
    with pytest.raises(RecordingError, match=why):
        read_samples(tmp_path / "all.csv", 20, 1000.0, layout, "P01")


def test_another_persons_rows_are_left_to_that_person(tmp_path: Path) -> None:
    layout = shared(tmp_path / "all.csv", ["P011"])
    samples = read_samples(tmp_path / "all.csv", 20, 1000.0, layout, "P01")
    assert len(samples.status) == len(recording(1))


def workbook(path: Path, table: pd.DataFrame) -> Workbook:
    table.to_excel(path, index=False)
    from openpyxl import load_workbook

    return load_workbook(path)


def test_hidden_rows_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "S.xlsx"
    book = workbook(path, recording(9))
    for row in (5, 6):
        book.active.row_dimensions[row].hidden = True
    book.save(path)
    with pytest.raises(RecordingError, match="has 2 hidden rows with content, the first of them 5"):
        read_samples(path, 20, 1000.0)


def test_merged_cells_have_the_value_that_is_seen(tmp_path: Path) -> None:
    path, table = tmp_path / "S.xlsx", recording(9)
    book = workbook(path, table)
    column = list(table).index("phase_index") + 1
    per = int((table["phase_index"] == 0).sum())
    for first in range(2, len(table) + 2, per):
        book.active.merge_cells(
            start_row=first, end_row=first + per - 1, start_column=column, end_column=column
        )
    book.save(path)
    samples = read_samples(path, 20, 1000.0)
    np.testing.assert_array_equal(np.bincount(samples.phase_index), np.full(20, per))


def test_per_cent_formats_are_fractions(tmp_path: Path) -> None:
    path, table = tmp_path / "S.xlsx", recording(9)
    book = workbook(path, table)
    column = list(table).index("fit_r2") + 1
    for row in range(2, len(table) + 2):
        book.active.cell(row, column).number_format = "0%"
    book.save(path)
    np.testing.assert_allclose(read_samples(path, 20, 1000.0).fit_r2, table["fit_r2"])


def test_a_line_break_in_a_name_is_a_blank(tmp_path: Path) -> None:
    path = tmp_path / "S.xlsx"
    recording(9).rename(columns={SPEED: "SWS\n(m/s)", "rr_ms": "RR\n(ms)"}).to_excel(path, index=False)
    proposal = proposal_for(path)
    assert proposal.columns[SPEED] == "SWS (m/s)"
    layout = layout_of({"columns": dict(proposal.columns)}, path)
    np.testing.assert_allclose(read_samples(path, 20, 1000.0, layout).speed_m_s, recording(9)[SPEED])


LINES = {
    "decimal commas everywhere": "time_ms;rr_ms;SWS\n100,5;1000,0;2,5\n300,5;1000,0;3,5\n700,0;1000,0;1,5\n",
    "sep=": "sep=;\ntime_ms;rr_ms;SWS\n100,5;1000;2,5\n300,5;1000;3,5\n700;1000;1,5\n",
    "a long comment": "# note\n" * 60 + "time_ms,rr_ms,SWS\n100.5,1000,2.5\n300.5,1000,3.5\n700,1000,1.5\n",
    "names behind #, decimal commas": "#time_ms;rr_ms;SWS\n100,5;1000;2,5\n300,5;1000;3,5\n700;1000;1,5\n",
    "names behind #": "# made by a tool\n# time_ms,rr_ms,SWS\n100.5,1000,2.5\n300.5,1000,3.5\n700,1000,1.5\n",
}


@pytest.mark.parametrize("kind", LINES)
def test_csv_as_people_have_it(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "S.CSV"
    path.write_text(LINES[kind], encoding="utf-8")
    samples = read_free_samples(path, 1000.0, layout_of({"columns": {SPEED: "SWS"}}, path))
    assert samples.time_ms.tolist() == [100.5, 300.5, 700.0]
    assert samples.speed_m_s.tolist() == [2.5, 3.5, 1.5]


def test_a_curve_without_variation_is_refused(tmp_path: Path) -> None:
    from swesbi.recording.ingest import ingest

    samples = read(tmp_path / "S.csv", recording(3).assign(**{SPEED: 2.0}, status="ok", fit_r2=0.9))
    with pytest.raises(RecordingError, match="every phase has the same speed, 2 m/s"):
        ingest(samples, free_case.HEART, QUALITY, 100)


def test_phases_are_counted_by_rows_where_samples_stand_side_by_side(tmp_path: Path) -> None:
    table = recording(5)
    index = ["repeat", "phase_index", "trigger_delay_ms", "rr_ms"]
    wide = table.pivot_table(index=index, columns="sample", values=SPEED, dropna=False).dropna(how="all")
    wide.columns = [f"c {number}" for number in wide.columns]
    wide.reset_index().drop(columns="phase_index").to_csv(tmp_path / "S.csv", index=False)
    said = {
        "columns": {SPEED: "c *"},
        "table": {"values": {"phase_index": "counted", "status": "ok", "fit_r2": 1}},
    }
    samples = read_samples(tmp_path / "S.csv", 20, 1000.0, layout_of(said, tmp_path / "S.csv"))
    repeats, each = table["repeat"].nunique(), table["sample"].nunique()
    np.testing.assert_array_equal(np.bincount(samples.phase_index), np.full(20, repeats * each))
