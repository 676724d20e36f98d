"""What can be wrong with free-running recordings, overrides and tables of other tools: one case each."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import free_case
import pandas as pd
import yaml
from cohorts import recording

Break = Callable[[Path], object]
SPEED = "shear_wave_speed_m_s"
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


def set_cell(column: str, value: object, row: int = 0) -> Callable[[pd.DataFrame], pd.DataFrame]:
    def change(frame: pd.DataFrame) -> pd.DataFrame:
        frame.loc[row, column] = value
        return frame

    return change


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
}
OVERRIDES: dict[str, tuple[Break, str]] = {
    "no YAML": (own("noise: {\n"), "S-3.yaml.*cannot be read as YAML.*; "),
    "a list": (own("- 1\n"), "S-3.yaml.*; "),
    "bytes that are no text": (content(OWN, b"\xff\xfe\x00n"), "S-3.yaml.*; "),
    "an unknown key": (own("noises: 3\n"), "'noises' is no key that a recording may say for itself.*; "),
    "noise of half": (own("noise: { cv_fraction: 0.1 }\n"), "S-3.yaml.*belong together.*; "),
    "two phases": (
        own("protocol: { phases: 2 }\n", "swe/S-1.yaml"),
        "S-1.yaml: '2' under the key `protocol.phases`.*; ",
    ),
    "a folder": (lambda cohort: ((cohort / OWN).unlink(), (cohort / OWN).mkdir()), "S-3.yaml.*; "),
}
WORKBOOKS: dict[str, tuple[Break, str]] = {
    "empty sheet": (workbook(sheets(one=pd.DataFrame())), "S-3.xlsx.*; "),
    "a date": (
        workbook(sheets(one=free_case.train(2).astype(object).assign(time_ms=pd.Timestamp("2026-01-02")))),
        "S-3.xlsx.*time_ms.*2026-01-02.*; ",
    ),
}
WIDE: dict[str, tuple[Break, str]] = {
    "text in a sample": (
        wide(lambda f: set_cell("c 2", "x")(f)),
        "row 2, column 'c 2': 'x' is not a number; ",
    ),
    "a sample in mm/s": (
        wide(lambda f: set_cell("c 2", 2100)(f)),
        "row 2, column 'c 2': '2100' is outside .0.05, 30.; ",
    ),
}
NEW_KINDS = {
    f"{kind}: {name}": case
    for kind, cases in (
        ("free-running", FREE),
        ("override", OVERRIDES),
        ("workbook", WORKBOOKS),
        ("wide", WIDE),
    )
    for name, case in cases.items()
}
