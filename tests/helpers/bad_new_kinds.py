"""What can be wrong with free-running recordings, overrides and tables of other tools: one case each."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import free_case
import h5py
import numpy as np
import pandas as pd
import yaml
from cohorts import recording
from scipy.io import savemat

Break = Callable[[Path], object]
SPEED = "shear_wave_speed_m_s"
FOREIGN = {
    "columns": {
        "phase_index": "Gate", "trigger_delay_ms": "Delay (s)", "rr_ms": "RR (s)", "repeat": "Acq",
        "sample": "ROI", SPEED: "SWS (cm/s)", "fit_r2": "R2", "status": "Flag",
    },
    "units": {"trigger_delay_ms": "s", "rr_ms": "s", SPEED: "cm/s"},
}  # fmt: skip
TRAIN, OWN, GATED = "swe/S-3.csv", "swe/S-3.yaml", "swe/S-1.csv"


def pushes(change: Callable[[pd.DataFrame], object]) -> Break:
    """Change the train of S-3; what is returned takes its place."""

    def broken(cohort: Path) -> None:
        frame = pd.read_csv(cohort / TRAIN, dtype={SPEED: object, "time_ms": object, "beat": object})
        changed = change(frame)
        (frame if changed is None else changed).to_csv(cohort / TRAIN, index=False)

    return broken


def cell(column: str, value: object, row: int = 2) -> Break:
    """Set one cell of the train; ``row`` is its line in the file."""

    def change(frame: pd.DataFrame) -> pd.DataFrame:
        wider = frame.astype({column: object})
        wider.loc[row - 2, column] = value
        return wider

    return pushes(change)


def with_errors(value: object) -> Break:
    """Give the train standard errors, one of which is ``value``."""

    def change(frame: pd.DataFrame) -> pd.DataFrame:
        wider = frame.assign(se_m_s=0.1, status="ok", shear_wave_speed_m_s=2.0).astype({"se_m_s": object})
        wider.loc[1, "se_m_s"] = value
        return wider

    return pushes(change)


def own(text: str, name: str = OWN) -> Break:
    return lambda cohort: (cohort / name).write_text(text)


def content(name: str, raw: bytes) -> Break:
    return lambda cohort: (cohort / name).write_bytes(raw)


def said(changes: dict[str, Any], change: Callable[[pd.DataFrame], pd.DataFrame] | None = None) -> Break:
    """Write S-1 as another tool would, with this said in ``swe/S-1.yaml`` beside the mapping."""

    def broken(cohort: Path) -> None:
        frame = as_others_write(recording())
        (change(frame) if change else frame).to_csv(cohort / GATED, index=False)
        (cohort / "swe" / "S-1.yaml").write_text(yaml.safe_dump({**FOREIGN, **changes}))

    return broken


def as_others_write(frame: pd.DataFrame) -> pd.DataFrame:
    other = frame.assign(
        trigger_delay_ms=frame["trigger_delay_ms"] / 1000,
        rr_ms=frame["rr_ms"] / 1000,
        shear_wave_speed_m_s=100.0 * frame[SPEED],
    )
    return other.rename(columns=FOREIGN["columns"]).astype(object)


def set_cell(column: str, value: object, row: int = 0) -> Callable[[pd.DataFrame], pd.DataFrame]:
    def change(frame: pd.DataFrame) -> pd.DataFrame:
        frame.loc[row, column] = value
        return frame

    return change


def mapped(column: str, name: object) -> dict[str, Any]:
    return {"columns": {**FOREIGN["columns"], column: name}}


def workbook(write: Callable[[Path], object]) -> Break:
    """Put a workbook in the place of the train."""

    def broken(cohort: Path) -> None:
        (cohort / TRAIN).unlink()
        write((cohort / TRAIN).with_suffix(".xlsx"))

    return broken


def sheets(**frames: pd.DataFrame) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        with pd.ExcelWriter(path) as book:
            for name, frame in frames.items():
                frame.to_excel(book, sheet_name=name, index=False)

    return write


def matlab(write: Callable[[Path], object]) -> Break:
    """Put a .mat file in the place of the train."""

    def broken(cohort: Path) -> None:
        (cohort / TRAIN).unlink()
        write((cohort / TRAIN).with_suffix(".mat"))

    return broken


def vectors(**changes: object) -> Callable[[Path], None]:
    """Write the train as vectors of a .mat file, some of which are others or, if None, left out."""
    train = free_case.train(2)
    plain = {name: train[name].to_numpy() for name in ("time_ms", "rr_ms", "beat", SPEED)}
    kept = {name: value for name, value in {**plain, **changes}.items() if value is not None}
    return lambda path: savemat(path, kept)


def wide(change: Callable[[pd.DataFrame], pd.DataFrame], pattern: str = "c *") -> Break:
    """Write S-1 with a column a sample, and break it."""

    def broken(cohort: Path) -> None:
        keys = ["phase_index", "trigger_delay_ms", "rr_ms", "repeat"]
        frame = recording()
        table = frame.pivot_table(index=keys, columns="sample", values=SPEED).reset_index()
        table.columns = [name if isinstance(name, str) else f"c {name}" for name in table.columns]
        change(table.astype(object)).to_csv(cohort / GATED, index=False)
        layout = {"columns": {SPEED: pattern}, "table": {"values": {"fit_r2": 1, "status": "ok"}}}
        (cohort / "swe" / "S-1.yaml").write_text(yaml.safe_dump(layout))

    return broken


def cut(path: Path) -> None:
    sheets(one=free_case.train(2))(path)
    path.write_bytes(path.read_bytes()[:3000])


def not_a_table(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["other"] = np.ones(3)


FREE: dict[str, tuple[Break, str]] = {
    "text for a time": (cell("time_ms", "early"), "row 2, column 'time_ms': 'early' is not a number; "),
    "negative time": (cell("time_ms", -4), "row 2, column 'time_ms': '-4' is outside .0, 5000.; "),
    "time in s": (
        pushes(lambda f: f.assign(time_ms=f["time_ms"].astype(float) / 1000)),
        "S-3.csv, column 'time_ms': the latest push is 1 ms after its R peak; check the unit",
    ),
    "after its beat": (
        cell("time_ms", 1900),
        "row 2, column 'time_ms': '1900' lies after the end of its beat",
    ),
    "RR in s": (cell("rr_ms", 0.98), "row 2, column 'rr_ms': '0.98' is outside .150, 5000.; "),
    "infinite RR": (cell("rr_ms", "inf"), "row 2, column 'rr_ms': 'inf' is not a number; "),
    "another heart rate": (
        pushes(lambda f: f.assign(rr_ms=500.0, time_ms=f["time_ms"].astype(float) / 2.1)),
        "median RR interval is 500 ms.*; ",
    ),
    "half a beat": (cell("beat", 0.5), "row 2, column 'beat': '0.5' is not a whole number; "),
    "speed in cm/s": (
        cell(SPEED, 210),
        "row 2, column 'shear_wave_speed_m_s': '210' is outside .0.05, 30.; ",
    ),
    "all speeds in km/h": (
        pushes(lambda f: f.assign(**{SPEED: f[SPEED].astype(float) / 10})),
        "S-3.csv.*median shear.wave speed.*; ",
    ),
    "no speed at all": (pushes(lambda f: f.drop(columns=SPEED)), "S-3.csv.* has none of the columns .*; "),
    "a word for a status": (cell("status", "good"), "row 2, column 'status': 'good' is none of ok.*; "),
    "same push twice": (
        pushes(lambda f: pd.concat([f, f[:1]])),
        "repeats the beat, time_ms of an earlier row; ",
    ),
    "one push": (
        pushes(lambda f: f[:1].assign(**{SPEED: 2.0, "status": "ok"})),
        "1 pushes are acceptable of 1 .*; .*needs 2",
    ),
    "no rows": (pushes(lambda f: f[:0]), "S-3.csv: holds no data row; "),
    "no RR": (pushes(lambda f: f.drop(columns="rr_ms")), "S-3.csv, row 1: lacks the columns rr_ms; "),
    "instants and phases": (pushes(lambda f: f.assign(phase_index=0)), "S-3.csv, row 1: .*; "),
    "error of zero": (with_errors(0), "row 3, column 'se_m_s': '0' is no standard error.*; "),
    "error above the speed": (
        with_errors(9),
        "row 3, column 'se_m_s': '9' is not smaller than the speed.*; ",
    ),
    "an error missing": (
        with_errors(""),
        "S-3.csv, column 'se_m_s': '' of the push at time_ms .* is empty beside a speed.*; give it",
    ),
    "nothing tells the errors": (own("{}\n"), "S-3.csv.*nothing says how large.*; add a column se_m_s"),
    "fits without R2": (own("noise: { fit_points: 12 }\n"), "S-3.csv.*fit_r2.*; "),
    "zero bytes": (content(TRAIN, b"time_ms,rr_ms\0\n1,2\n"), "S-3.csv: holds zero bytes.*; "),
    "Latin 1": (
        content(TRAIN, "time_ms,rr_ms,größe\n1,2,3\n".encode("latin-1")),
        "S-3.csv: cannot be read as UTF-8.*; ",
    ),
}
OVERRIDES: dict[str, tuple[Break, str]] = {
    "no YAML": (own("noise: {\n"), "S-3.yaml.*cannot be read as YAML.*; "),
    "a list": (own("- 1\n"), "S-3.yaml.*; "),
    "bytes that are no text": (content(OWN, b"\xff\xfe\x00n"), "S-3.yaml.*; "),
    "an unknown key": (own("noises: 3\n"), "'noises' is no key that a recording may say for itself.*; "),
    "noise of half": (own("noise: { cv_fraction: 0.1 }\n"), "S-3.yaml.*belong together.*; "),
    "noise of 500 %": (
        own("noise: { cv_fraction: 5, cv_log_sd: 0.3 }\n"),
        "S-3.yaml: .*'cv_fraction': 5.*noise.cv_fraction.*; ",
    ),
    "noise as text": (own("noise: { fit_points: many }\n"), "S-3.yaml: .*many.*noise.fit_points.*; "),
    "two phases": (
        own("protocol: { phases: 2 }\n", "swe/S-1.yaml"),
        "S-1.yaml: '2' under the key `protocol.phases`.*; ",
    ),
    "other repeats": (
        own("protocol: { repeats_are: beats }\n", "swe/S-1.yaml"),
        "S-1.yaml: 'beats' under the key `protocol.repeats_are`.*; ",
    ),
    "a folder": (lambda cohort: ((cohort / OWN).unlink(), (cohort / OWN).mkdir()), "S-3.yaml.*; "),
}
FOREIGN_TABLES: dict[str, tuple[Break, str]] = {
    "speed in km/s": (
        said({"units": {SPEED: "km/s"}}),
        "'km/s' under the key `units.shear_wave_speed_m_s` is not known; write",
    ),
    "a column that is not there": (said(mapped("rr_ms", "Beat")), "S-1.csv.*lacks the columns Beat; "),
    "a value in the file's unit": (
        said({}, set_cell("SWS (cm/s)", "9e9")),
        "row 2, column 'SWS .cm/s.': '9e9' read in cm/s.*; ",
    ),
    "a word": (said({}, set_cell("RR (s)", "fast")), "row 2, column 'RR .s.': 'fast' read in s.*; "),
    "a status of its own": (said({}, set_cell("Flag", "valid")), "column 'Flag': 'valid' is none of ok.*; "),
    "no key": (said({"columns": {"speed": "SWS"}}), "'SWS' under the key `columns.speed` is for no column; "),
    "header further down": (said({"table": {"header_row": 900}}), "S-1.csv.*; "),
}
WORKBOOKS: dict[str, tuple[Break, str]] = {
    "no workbook": (
        workbook(lambda path: path.write_bytes(b"PK\x03\x04")),
        "S-3.xlsx: cannot be read as a workbook.*; ",
    ),
    "cut off": (workbook(cut), "S-3.xlsx: cannot be read as a workbook.*; "),
    "empty sheet": (workbook(sheets(one=pd.DataFrame())), "S-3.xlsx.*; "),
    "two sheets": (
        workbook(sheets(one=free_case.train(2), two=free_case.train(3))),
        "has 2 sheets with rows: one, two; name the one",
    ),
    "a formula": (
        workbook(sheets(one=free_case.train(2).astype(object).assign(time_ms="=1+1"))),
        "'=1.1' is a formula whose value was never computed.*; ",
    ),
    "a date": (
        workbook(sheets(one=free_case.train(2).astype(object).assign(time_ms=pd.Timestamp("2026-01-02")))),
        "S-3.xlsx.*time_ms.*2026-01-02.*; ",
    ),
}
WIDE: dict[str, tuple[Break, str]] = {
    "no column fits": (
        wide(lambda f: f, "speed *"),
        "'speed .' stands for shear_wave_speed_m_s, and matches no column; ",
    ),
    "text in a sample": (
        wide(lambda f: set_cell("c 2", "x")(f)),
        "row 2, column 'c 2': 'x' is not a number; ",
    ),
    "a sample in mm/s": (
        wide(lambda f: set_cell("c 2", 2100)(f)),
        "row 2, column 'c 2': '2100' is outside .0.05, 30.; ",
    ),
    "no repeat": (wide(lambda f: f.drop(columns="repeat")), "S-1.csv, row 1: lacks the columns repeat; "),
}
MATLAB: dict[str, tuple[Break, str]] = {
    "text": (matlab(lambda path: path.write_text("time_ms")), "S-3.mat: cannot be read as a .mat.*; "),
    "nothing that is known": (matlab(not_a_table), "S-3.mat.*; "),
    "no times": (matlab(vectors(time_ms=None)), "S-3.mat.*lacks the columns .*; "),
    "of other lengths": (
        matlab(vectors(rr_ms=np.ones(3))),
        "S-3.mat: its vectors differ in length .*rr_ms 3.*; ",
    ),
    "a matrix": (
        matlab(vectors(time_ms=np.ones((5, 7)))),
        "S-3.mat, column 'time_ms': is an array of 5 x 7; ",
    ),
    "complex times": (matlab(vectors(time_ms=1j * np.ones(62))), "S-3.mat, column 'time_ms': is complex; "),
    "NaN times": (matlab(vectors(time_ms=np.full(62, np.nan))), "S-3.mat.*column 'time_ms'.*; "),
}
NEW_KINDS = {
    f"{kind}: {name}": case
    for kind, cases in (
        ("free-running", FREE),
        ("override", OVERRIDES),
        ("foreign", FOREIGN_TABLES),
        ("workbook", WORKBOOKS),
        ("wide", WIDE),
        ("mat", MATLAB),
    )
    for name, case in cases.items()
}
