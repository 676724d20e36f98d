"""Kinds of files that people have: how each differs from a good cohort, and what is to be said of it.

The good cohort has gated recordings, S-1 and s_2x, and a free-running one, S-3 (``free_case.mixed``). Words
that begin with OK are of recordings that are read; all others of a refusal.
"""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import free_case
import h5py
import numpy as np
import pandas as pd
import yaml
from cohorts import recording
from openpyxl import load_workbook
from openpyxl.comments import Comment
from openpyxl.styles import Font
from openpyxl.worksheet.worksheet import Worksheet
from scipy.io import savemat

Break = Callable[[Path], object]
Kinds = dict[str, tuple[Break, str]]
OK = "OK "
SPEED = "shear_wave_speed_m_s"
TRAIN, OWN, GATED = "swe/S-3.csv", "swe/S-3.yaml", "swe/S-1.csv"
LONG_ROW = "A" * 140_000


def pushes(change: Callable[[pd.DataFrame], object], name: str = TRAIN) -> Break:
    """Change the table of a recording, S-3 where no other is named; what is returned takes its place."""

    def broken(cohort: Path) -> None:
        texts = (SPEED, "time_ms", "beat") if name == TRAIN else ()
        frame = pd.read_csv(cohort / name, dtype=dict.fromkeys(texts, object))
        changed = change(frame)
        (frame if changed is None else changed).to_csv(cohort / name, index=False)

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
        wider = frame.assign(se_m_s=0.1, status="ok", **{SPEED: varied(frame)}).astype({"se_m_s": object})
        wider.loc[1, "se_m_s"] = value
        return wider

    return pushes(change)


def varied(frame: pd.DataFrame) -> pd.Series[float]:
    return pd.Series(2.0 + 0.01 * np.arange(len(frame)))


def in_parts(**parts: Kinds) -> Kinds:
    """Name kinds by their part: "files: tabs"."""
    return {f"{part}: {name}": kind for part, kinds in parts.items() for name, kind in kinds.items()}


def content(name: str, raw: str | bytes) -> Break:
    return lambda cohort: (cohort / name).write_bytes(raw if isinstance(raw, bytes) else raw.encode())


def text(change: Callable[[str], str], name: str = TRAIN) -> Break:
    """Change the text of a file."""
    return lambda cohort: (cohort / name).write_text(change((cohort / name).read_text()), newline="")


def moved(name: str, other: str) -> Break:
    return lambda cohort: (cohort / name).rename(cohort / other)


def both(*breaks: Break) -> Break:
    return lambda cohort: [broken(cohort) for broken in breaks]


def book(change: Callable[[Worksheet, pd.DataFrame], object], name: str = TRAIN) -> Break:
    """Put a workbook in the place of a recording, S-3 where no other is named, and change its sheet."""

    def broken(cohort: Path) -> None:
        path, frame = cohort / name, pd.read_csv(cohort / name)
        path.unlink()
        frame.to_excel(path.with_suffix(".xlsx"), index=False)
        workbook = load_workbook(path.with_suffix(".xlsx"))
        change(workbook.active, frame)
        workbook.save(path.with_suffix(".xlsx"))

    return broken


def formatted(column: str, number_format: str, factor: float, name: str = TRAIN) -> Break:
    """Write a column times a factor, in a number format."""

    def change(sheet: Worksheet, frame: pd.DataFrame) -> None:
        place = list(frame).index(column) + 1
        for row in range(2, len(frame) + 2):
            one = sheet.cell(row, place)
            one.value = None if one.value is None else round(factor * float(one.value), 6)
            one.number_format = number_format

    return book(change, name)


def raw_book(part: Callable[[bytes], bytes], name: str) -> Break:
    """Put a workbook in the place of the train, with one part of it changed."""

    def broken(cohort: Path) -> None:
        book(lambda *_: None)(cohort)
        path = (cohort / TRAIN).with_suffix(".xlsx")
        with zipfile.ZipFile(path) as archive:
            parts = {member: archive.read(member) for member in archive.namelist()}
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for member, own in parts.items():
                archive.writestr(member, part(own) if member == name else own)

    return broken


def matlab(write: Callable[[Path, pd.DataFrame], object]) -> Break:
    """Put a .mat file in the place of the train, of which the accepted pushes are given."""

    def broken(cohort: Path) -> None:
        frame = pd.read_csv(cohort / TRAIN).dropna().drop(columns="status")
        (cohort / TRAIN).unlink()
        write((cohort / TRAIN).with_suffix(".mat"), frame)

    return broken


def vectors(frame: pd.DataFrame, names: Callable[[str], str] = str) -> dict[str, Any]:
    return {names(name): frame[name].to_numpy() for name in frame}


def huge(path: Path, frame: pd.DataFrame) -> None:
    """Few bytes of a dataset that would fill memory: its chunks were never written."""
    with h5py.File(path, "w") as file:
        for name in frame:
            file[name] = frame[name].to_numpy()
        file.create_dataset("beat2", (4_000_000, 400), dtype="f8", chunks=(1000, 400))
        del file["rr_ms"]
        file["rr_ms"] = file["beat2"]


def beats(frame: pd.DataFrame, *rr_ms: float) -> pd.DataFrame:
    """The train with the RR intervals of its beats in turn, as many beats as these."""
    parts = [
        frame[frame["beat"].astype(int) == number % 2].assign(beat=number) for number in range(len(rr_ms))
    ]
    for number, (part, rr) in enumerate(zip(parts, rr_ms, strict=True)):
        share = part["time_ms"].astype(float) / part["rr_ms"]
        speed = part[SPEED].astype(float) * (1.0 + 0.013 * number)
        parts[number] = part.assign(time_ms=(share * rr).round(1), rr_ms=rr, **{SPEED: speed.round(3)})
    return pd.concat(parts)


def repeat_copied(frame: pd.DataFrame) -> pd.DataFrame:
    chosen = frame["phase_index"] == 4
    first = frame.loc[chosen & (frame["repeat"] == 0), [SPEED, "status", "fit_r2"]].to_numpy()
    frame.loc[chosen & (frame["repeat"] == 2), [SPEED, "status", "fit_r2"]] = first
    return frame


def phase_copied(frame: pd.DataFrame) -> pd.DataFrame:
    values = frame.loc[frame["phase_index"] == 4, [SPEED, "status", "fit_r2"]].to_numpy()
    frame.loc[frame["phase_index"] == 5, [SPEED, "status", "fit_r2"]] = values
    return frame


def wide(change: Callable[[pd.DataFrame], pd.DataFrame]) -> Break:
    """Write S-1 with a column a sample, and break it."""

    def broken(cohort: Path) -> None:
        keys = ["phase_index", "trigger_delay_ms", "rr_ms", "repeat"]
        table = recording().pivot_table(index=keys, columns="sample", values=SPEED).reset_index()
        samples = [name for name in table.columns if not isinstance(name, str)]
        table.columns = [name if isinstance(name, str) else f"c {name}" for name in table.columns]
        change(table.astype(object)).to_csv(cohort / GATED, index=False)
        said = {
            "samples": [{SPEED: f"c {name}"} for name in samples],
            "values": {"fit_r2": 1, "status": "ok"},
        }
        (cohort / "swe" / "S-1.yaml").write_text(yaml.safe_dump({"table": said}))

    return broken


def set_cell(column: str, value: object, row: int = 0) -> Callable[[pd.DataFrame], pd.DataFrame]:
    def change(frame: pd.DataFrame) -> pd.DataFrame:
        frame.loc[row, column] = value
        return frame

    return change


def mapped(frame: Callable[[pd.DataFrame], pd.DataFrame], **said: object) -> Break:
    """Change the train, and say how it is to be read."""
    return both(pushes(frame), content(OWN, free_case.NOISE + (yaml.safe_dump(said) if said else "")))


CSV: Kinds = {
    "a quote that closes rows later": (
        both(
            pushes(lambda f: f.assign(remark=["late" if n in (5, 9) else "" for n in range(len(f))])),
            text(lambda all: all.replace(",late", ',"late')),
        ),
        r"S-3.csv, row \d+: has a quote that opens a cell and does not close it in the same row",
    ),
    "a quote that never closes": (
        text(lambda all: all.replace("\n", '\n"', 9).replace('"', "", 8)),
        "S-3.csv, row 10: has a quote that opens a cell and does not close it in the same row; remove",
    ),
    "text behind a quote": (
        text(lambda all: all.replace(",ok", ',"ok"x', 1)),
        "has text behind a closing quote",
    ),
    "a cell without end": (
        text(lambda all: all.replace("ok", LONG_ROW, 1)),
        r"S-3.csv, row \d+: cannot be read",
    ),
    "row names of R": (
        text(
            lambda all: "\n".join(f'"{n}",{line}' if n else line for n, line in enumerate(all.splitlines()))
        ),
        "S-3.csv: each row has a first cell that the row of names does not name, as R writes row names",
    ),
    "rows that end in a delimiter": (
        text(lambda all: all.replace("\n", ",\n").replace(",\n", "\n", 1)),
        "S-3.csv: its rows end in a delimiter, and the row of names does not; remove it",
    ),
    "names that end in a delimiter": (
        text(lambda all: all.replace("\n", ",\n", 1)),
        "S-3.csv: the row of names ends in a delimiter, and the others do not; remove it",
    ),
    "columns separated by blanks": (
        text(lambda all: all.replace(",", " ")),
        "lacks the columns .*; separate the columns by commas, semicolons",
    ),
    "columns separated by strokes": (
        text(lambda all: all.replace(",", "|")),
        "lacks the columns .*; separate the columns by commas, semicolons",
    ),
    "a zero-width blank in a name": (
        text(lambda all: "\u200b" + all),
        r"'.u200btime_ms' should be 'time_ms' \(with U\+200B\)",
    ),
    "a soft hyphen in a name": (
        text(lambda all: all.replace("rr_ms", "rr\u00ad_ms", 1)),
        r"should be 'rr_ms' \(with U\+00AD\)",
    ),
    "a zero-width blank in a status": (
        cell("status", "ok\u200b"),
        r"row 2, column 'status': 'ok.u200b' \(with U\+200B\) is none of ok",
    ),
    "a narrow blank between digits": (
        cell("rr_ms", "1\u202f000"),
        r"row 2, column 'rr_ms': .* \(with U\+202F\) is not a number",
    ),
    "a column of units": (
        mapped(
            lambda f: f.assign(Unit=["kPa", "m/s"] * (len(f) // 2) + ["m/s"] * (len(f) % 2)),
        ),
        "column 'Unit': 'kPa, m/s' states units row by row, in which no column is read throughout",
    ),
    "a column of one other unit": (
        mapped(lambda f: f.rename(columns={SPEED: "Value"}).assign(Unit="cm/s"), columns={SPEED: "Value"}),
        "column 'Unit': 'cm/s' states units row by row",
    ),
    "a column of the right unit": (
        mapped(lambda f: f.rename(columns={SPEED: "Value"}).assign(Unit="m/s"), columns={SPEED: "Value"}),
        OK,
    ),
    "two views in one recording": (
        pushes(lambda f: f.assign(view=["PLAX", "A4C"] * (len(f) // 2) + ["A4C"] * (len(f) % 2))),
        OK + "S-3: not used, though its rows differ in it: view",
    ),
    "a status in capitals": (
        pushes(lambda f: f.rename(columns={"status": "Status"})),
        "column 'Status': is not read, and looks like status",
    ),
    "a beat in capitals": (
        pushes(lambda f: f.rename(columns={"beat": "Beat"})),
        "column 'Beat': is not read, and looks like beat",
    ),
    "standard errors by a slip of the pen": (
        pushes(lambda f: f.assign(se_ms=0.1)),
        "column 'se_ms': is not read, and looks like se_m_s",
    ),
    "a row that is made a comment": (
        text(lambda all: "#".join(all.splitlines(keepends=True)[:3]) + "".join(all.splitlines(True)[3:])),
        OK + "S-3: rows that begin with # are left out: 2, 3",
    ),
    "a title above the names": (
        text(lambda all: "Export of a scanner\n\n" + all),
        "row 1: has 1 cells, and the rows from 3 on have 5; .* say `table: { header_row: 3 }`",
    ),
    "a line below the table": (
        text(lambda all: all + "Exported by a scanner\n"),
        "row 64: has 1 cells, the header has 5; remove blank lines and others that are no rows",
    ),
    "RR without its unit": (pushes(lambda f: f.rename(columns={"rr_ms": "rr"})), "'rr' should be 'rr_ms'"),
}
TWICE: Kinds = {
    "a beat": (
        pushes(lambda f: pd.concat([f, f[f["beat"] == "0"].assign(beat=7)])),
        "beat 7 has the same .* speeds as beat 0",
    ),
    "a beat that is meant": (
        both(
            pushes(lambda f: pd.concat([f, f[f["beat"] == "0"].assign(beat=7)])),
            content(OWN, free_case.NOISE + "table: { copies_allowed: true }\n"),
        ),
        OK,
    ),
    "a repeat": (
        pushes(repeat_copied, GATED),
        "repeat 2 of phase_index 4 has the same .* as repeat 0 of phase_index 4",
    ),
    "a phase": (pushes(phase_copied, GATED), "repeat 0 of phase_index 5 has the same .* of phase_index 4"),
    "a recording under two names": (
        both(
            lambda cohort: shutil.copy(cohort / TRAIN, cohort / "swe" / "S-4.csv"),
            content("swe/S-4.yaml", free_case.NOISE),
            text(lambda all: all + "S-4,F,25,1.7,60,90,34,0.8\n", "subjects.csv"),
        ),
        "S-4.csv, column .*: has the same speeds as the recording of S-3",
    ),
    "a recording in another order and format": (
        both(
            lambda cohort: pd.read_csv(cohort / TRAIN)[::-1].to_excel(
                cohort / "swe" / "S-4.xlsx", index=False
            ),
            content("swe/S-4.yaml", free_case.NOISE),
            text(lambda all: all + "S-4,F,25,1.7,60,90,34,0.8\n", "subjects.csv"),
        ),
        "S-4.xlsx, column .*: has the same speeds as the recording of S-3",
    ),
    "one millisecond, two beats": (
        pushes(lambda f: pd.concat([f, f[:1].assign(rr_ms=977.0, **{SPEED: 1.7})]).drop(columns="beat")),
        OK,
    ),
    "one millisecond, one beat": (
        pushes(lambda f: pd.concat([f, f[:1].assign(**{SPEED: 1.7})]).drop(columns="beat")),
        "repeats the rr_ms, time_ms of an earlier row; number the beats in `beat` if these are two pushes",
    ),
}
WORKBOOKS: Kinds = {
    "a hidden column": (
        book(lambda sheet, f: setattr(sheet.column_dimensions["B"], "hidden", True)),
        "S-3.xlsx, column 'rr_ms': is hidden; delete the column, or show it",
    ),
    "a hidden column that is not used": (
        book(
            lambda sheet, f: (
                setattr(sheet.column_dimensions["G"], "hidden", True),
                setattr(sheet["G1"], "value", "x"),
            )
        ),
        OK,
    ),
    "hidden rows": (
        book(lambda sheet, f: setattr(sheet.row_dimensions[5], "hidden", True)),
        "has 1 hidden rows with content, the first of them 5",
    ),
    "a speed struck through": (
        book(lambda sheet, f: setattr(sheet["B4"], "font", Font(strike=True))),
        "S-3.xlsx, row 4, column 'rr_ms': .* is struck through; delete the row",
    ),
    "merged cells": (
        book(lambda sheet, f: sheet.merge_cells("B3:B9")),
        "S-3.xlsx, row 3, column 'rr_ms': has merged cells; unmerge",
    ),
    "a sign of per cent that is text": (formatted("fit_r2", '0.0"%"', 100.0, GATED), OK),
    "a format of thousands": (formatted("rr_ms", "0.0,", 1000.0), OK),
    "a format that adds a unit": (
        formatted(SPEED, '0.0" cm/s"', 100.0),
        rf"column '{SPEED}': '.* cm/s' is not a number",
    ),
    "a note at a cell": (
        book(lambda sheet, _: setattr(sheet["D5"], "comment", Comment("artefact?", "A"))),
        OK + "S-3: notes at cells are not read: D5 'artefact",
    ),
    "a format that hides": (
        formatted(SPEED, ";;;", 1.0),
        r"row \d+, column 'shear_wave_speed_m_s': '[0-9.]+' is hidden by its number format; delete",
    ),
    "a format that puts a word for a number": (
        formatted(SPEED, '[>2]"high";0.0', 1.0),
        r"column 'shear_wave_speed_m_s': '[0-9.]+high' is not a number",
    ),
    "strict": (
        raw_book(
            lambda own: own.replace(
                b"http://schemas.openxmlformats.org/spreadsheetml/2006/main",
                b"http://purl.oclc.org/ooxml/spreadsheetml/main",
            ),
            "xl/workbook.xml",
        ),
        "S-3.xlsx: is a 'Strict Open XML Spreadsheet'; save it as 'Excel Workbook",
    ),
    "a password": (
        both(moved(TRAIN, "swe/S-3.xlsx"), content("swe/S-3.xlsx", b"\xd0\xcf\x11\xe0" + b"\0" * 600)),
        "S-3.xlsx: is a workbook of the old form, or one that a password protects; save it",
    ),
    "a merged range without end": (
        raw_book(
            lambda own: own.replace(
                b"</sheetData>",
                b'</sheetData><mergeCells count="1"><mergeCell ref="B2:XFD1048576"/></mergeCells>',
            ),
            "xl/worksheets/sheet1.xml",
        ),
        "S-3.xlsx: has a sheet of more than 500000 cells",
    ),
    "a cell at the end of the sheet": (
        raw_book(
            lambda own: own.replace(
                b"</sheetData>", b'<row r="1048576"><c r="XFD1048576"><v>1</v></c></row></sheetData>'
            ),
            "xl/worksheets/sheet1.xml",
        ),
        "S-3.xlsx: has a sheet of more than 500000 cells",
    ),
    "two sheets": (
        book(
            lambda sheet, f: (sheet.parent.create_sheet("two").append(["a"]), sheet.parent["two"].append([1]))
        ),
        "has 2 sheets with rows: Sheet1, two; name the one that counts",
    ),
    "a formula without a value": (
        book(lambda sheet, f: setattr(sheet["B5"], "value", "=1+1")),
        "row 5, .*'=1.1' is a formula whose value",
    ),
    "no workbook": (
        both(moved(TRAIN, "swe/S-3.xlsx"), content("swe/S-3.xlsx", b"PK\x03\x04 no")),
        "cannot be read as a workbook",
    ),
    "an empty sheet": (book(lambda sheet, f: sheet.delete_rows(1, 99)), "S-3.xlsx.*; "),
    "a date": (
        book(lambda sheet, f: setattr(sheet["A2"], "value", pd.Timestamp("2026-01-02").to_pydatetime())),
        "S-3.xlsx.*time_ms.*2026-01-02.*; ",
    ),
}
MATLAB: Kinds = {
    "text of Octave": (
        matlab(lambda path, f: path.write_text("# Created by Octave 8.4\n# name: time_ms\n# type: matrix\n")),
        r"S-3.mat: is text, as Octave saves it; save it by save\('-v7'",
    ),
    "by h5py": (
        matlab(lambda path, f: h5py.File(path, "w").update({name: f[name].to_numpy() for name in f}) or None),
        OK,
    ),
    "names in capitals": (
        matlab(lambda path, f: savemat(path, vectors(f, str.upper))),
        "'TIME_MS' should be 'time_ms'",
    ),
    "a dataset without end": (matlab(huge), "S-3.mat, column 'rr_ms': has more values than a recording"),
    "settings beside the vectors": (
        matlab(lambda path, f: savemat(path, vectors(f) | {"prf": 30.0, "image": np.ones((9, 9))})),
        OK,
    ),
}
FILES: Kinds = {
    "tabs": (both(moved(TRAIN, "swe/S-3.tsv"), text(lambda all: all.replace(",", "\t"), "swe/S-3.tsv")), OK),
    "a suffix in capitals": (moved(TRAIN, "swe/S-3.CSV"), OK),
    "a name in capitals": (
        moved(TRAIN, "swe/s-3.csv"),
        "but there is s-3.csv; call the subject s-3, or the file S-3",
    ),
    "zeros before the number": (
        moved(TRAIN, "swe/S-03.csv"),
        "but there is S-03.csv; call the subject S-03, or the",
    ),
    "Stata": (
        moved(TRAIN, "swe/S-3.dta"),
        "S-3.dta: is of a statistics program; read it in Python, by swesbi",
    ),
    "parquet": (
        moved(TRAIN, "swe/S-3.parquet"),
        "S-3.parquet: is no table; read it in Python, by swesbi.rec",
    ),
    "packed": (moved(TRAIN, "swe/S-3.csv.gz"), "S-3.csv.gz: is packed; unpack it"),
    "a folder in capitals": (moved("swe", "SWE"), "swe: is no folder, but there is SWE; call it swe"),
    "recording.yml": (
        moved("recording.yaml", "recording.yml"),
        "no such file, but there is recording.yml; call it",
    ),
    "subjects in capitals": (
        moved("subjects.csv", "Subjects.csv"),
        "no such file, but there is Subjects.csv; call it",
    ),
    "subjects in a workbook": (
        moved("subjects.csv", "subjects.xlsx"),
        "but there is subjects.xlsx; save it as subj",
    ),
    "LVEF in place of LVESV": (
        text(lambda all: all.replace("lvesv_ml", "lvef_percent"), "subjects.csv"),
        r"lacks the columns lvesv_ml; it has [^()]*; name them",
    ),
}
YAML: Kinds = {
    "no YAML": (content(OWN, "noise: {\n"), "S-3.yaml.*cannot be read as YAML.*; "),
    "a list": (content(OWN, "- 1\n"), "S-3.yaml: holds list, expected keys with values; "),
    "bytes that are no text": (content(OWN, b"\xff\xfe\x00n"), "S-3.yaml: cannot be read as YAML.*; "),
    "a key twice": (
        content(OWN, free_case.NOISE * 2),
        "S-3.yaml: has the key 'noise' twice, in lines 1 and 2; keep one",
    ),
    "a key twice within another": (
        content(OWN, "noise: { cv_fraction: 0.1, cv_log_sd: 0.3, cv_fraction: 0.2 }\n"),
        "has the key 'cv_fraction' twice",
    ),
    "an unknown key": (
        content(OWN, "noises: 3\n"),
        "has the key `noises`, which is not known; did you mean `noise`",
    ),
    "an unknown key within another": (
        text(lambda all: all + "  probes: x\n", "recording.yaml"),
        "has the key `protocol.probes`, which is not known; did you mean `protocol.probe`",
    ),
    "a fact of one's own": (
        text(lambda all: all + "ward: 7\n", "recording.yaml"),
        "`ward`, which is not known; .*under the key `sources`",
    ),
    "a fact of one's own where it belongs": (
        text(lambda all: all + "sources: { ward: 7 }\n", "recording.yaml"),
        OK,
    ),
    "repeats_are elsewhere": (
        text(lambda all: all + "repeats_are: sweeps\n", "recording.yaml"),
        "did you mean `protocol.repeats_are`",
    ),
    "repeats_are misspelt": (
        text(lambda all: all + "  repeat_are: sweeps\n", "recording.yaml"),
        "did you mean `protocol.repeats_are`",
    ),
    "repeats of an unknown kind": (
        text(lambda all: all + "  repeats_are: both\n", "recording.yaml"),
        "'separate' or 'sweeps'",
    ),
    "aliases of aliases": (
        content(
            OWN,
            "a0: &a0 [x,x,x,x,x,x,x,x,x,x]\n"
            + "".join(f"a{n + 1}: &a{n + 1} [{','.join([f'*a{n}'] * 10)}]\n" for n in range(8)),
        ),
        "S-3.yaml: has more than 100000 values, its aliases counted",
    ),
    "without a bottom": (content(OWN, "noise: " + "[" * 5000), "S-3.yaml: is more than 60 levels deep"),
    "phases in octal": (
        content(OWN, free_case.NOISE + "protocol: { phases: 024 }\n"),
        "S-3.yaml: '024' under the key `protocol.phases`: Input should be a valid integer",
    ),
    "yes and no as words": (
        mapped(
            lambda f: f.assign(status=f["status"].map({"ok": "yes", "no_wave": "no"})),
            table={"statuses": {"yes": "ok", "no": "no_wave"}},
        ),
        OK,
    ),
    "noise of half": (content(OWN, "noise: { cv_fraction: 0.1 }\n"), "S-3.yaml.*belong together.*; "),
    "two phases": (
        content("swe/S-1.yaml", "protocol: { phases: 2 }\n"),
        "S-1.yaml: '2' .*`protocol.phases`.*; ",
    ),
    "a folder": (lambda cohort: ((cohort / OWN).unlink(), (cohort / OWN).mkdir()), "S-3.yaml.*; "),
    "a column of nobody": (
        content(OWN, "columns: { speed: x }\n"),
        "`columns.speed`: is none of subject, phase_index",
    ),
    "means with errors": (
        content(OWN, "columns: { shear_wave_speed_se_m_s: x }\n"),
        "means with standard errors of",
    ),
    "several columns": (
        content(OWN, "columns: { repeat: [a, b] }\n"),
        "`columns.repeat`: Input should be a valid str",
    ),
    "a speed and a modulus": (
        content(OWN, f"columns: {{ {SPEED}: c, youngs_modulus_kpa: E }}\n"),
        "`columns`: .* name the one that was",
    ),
    "an unknown unit": (content(OWN, f"units: {{ {SPEED}: km/h }}\n"), "'km/h' is none of m/s, cm/s, mm/s"),
    "a unit of what has none": (content(OWN, 'units: { repeat: "1" }\n'), "`units.repeat`: is none of"),
    "a table of all without names": (
        content(OWN, "table: { file: all.csv }\n"),
        "no column says whose a row is",
    ),
    "a phase of its own": (content(OWN, "table: { first_phase: 2 }\n"), "`table.first_phase`"),
    "an unknown status": (
        content(OWN, "table: { statuses: { good: fine } }\n"),
        "'fine' .*`table.statuses.good`",
    ),
    "a value of nobody": (
        content(OWN, "table: { values: { speed: 1 } }\n"),
        "`table.values.speed`: is none of",
    ),
    "repeats counted": (
        content(OWN, "table: { values: { repeat: counted } }\n"),
        "only phase_index and sample can",
    ),
    "a pattern": (
        content(OWN, f"columns: {{ {SPEED}: 'SWS *' }}\n"),
        "lacks the columns SWS .*`table.samples`",
    ),
    "partners of some": (
        content(OWN, f"table: {{ samples: [{{ {SPEED}: a, fit_r2: b }}, {{ {SPEED}: c }}] }}\n"),
        "the same columns of",
    ),
    "a name twice": (
        content(OWN, f"columns: {{ {SPEED}: a }}\ntable: {{ values: {{ {SPEED}: 1 }} }}\n"),
        "is said twice; keep",
    ),
}
VALUES: Kinds = {
    "text for a time": (cell("time_ms", "early"), "row 2, column 'time_ms': 'early' is not a number; "),
    "negative time": (cell("time_ms", -4), "row 2, column 'time_ms': '-4' is outside .0, 5000.; "),
    "time in s": (
        pushes(lambda f: f.assign(time_ms=f["time_ms"].astype(float) / 1000)),
        "S-3.csv, column 'time_ms': the latest push is 1 ms after its R peak; check the unit",
    ),
    "time in per cent of the beat": (
        pushes(lambda f: f.assign(time_ms=(100 * f["time_ms"].astype(float) / f["rr_ms"]).round(1))),
        "S-3.csv, column 'time_ms': the latest push .* can be per cent of the beat",
    ),
    "time in per cent by its name": (
        mapped(lambda f: f.rename(columns={"time_ms": "Time (% RR)"}), columns={"time_ms": "Time (% RR)"}),
        "column 'Time .% RR.': states %, and time_ms is read in ms, s",
    ),
    "speeds that are named kPa": (
        mapped(lambda f: f.rename(columns={SPEED: "SWS (kPa)"}), columns={SPEED: "SWS (kPa)"}),
        "states kPa, and .* read in m/s, .*; map it to youngs_modulus_kpa or shear_modulus_kpa",
    ),
    "speeds of two units": (
        mapped(
            lambda f: f.rename(columns={SPEED: "SWS (cm/s)"}),
            columns={SPEED: "SWS (cm/s)"},
            units={SPEED: "mm/s"},
        ),
        "states cm/s, and `units.shear_wave_speed_m_s` of recording.yaml is mm/s; correct one",
    ),
    "speeds in kPa": (
        pushes(lambda f: f.assign(**{SPEED: (3 * f[SPEED].astype(float) ** 2).round(2)})),
        f"'{SPEED}': .* is outside .0.05, 30.; .*kPa are for the column youngs_modulus_kpa",
    ),
    "after its beat": (cell("time_ms", 1900), "'time_ms': '1900' lies after the end of its beat"),
    "RR in s": (cell("rr_ms", 0.98), "row 2, column 'rr_ms': '0.98' is outside .150, 5000.; "),
    "another heart rate": (
        pushes(lambda f: f.assign(rr_ms=500.0, time_ms=f["time_ms"].astype(float) / 2.1)),
        "median RR interval is 500 ms.*; ",
    ),
    "half a beat": (cell("beat", 0.5), "row 2, column 'beat': '0.5' is not a whole number; "),
    "speed in cm/s": (cell(SPEED, 210), f"row 2, column '{SPEED}': '210' is outside .0.05, 30.; "),
    "all speeds in km/h": (
        pushes(lambda f: f.assign(**{SPEED: f[SPEED].astype(float) / 10})),
        "median shear.wave speed.*; ",
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
    "natural waves": (pushes(lambda f: f.assign(event="mvc")), "column 'event': says what set off each wave"),
    "instants and phases": (pushes(lambda f: f.assign(phase_index=0)), "S-3.csv, row 1: lacks .*; "),
    "error of zero": (with_errors(0), "row 3, column 'se_m_s': '0' is no standard error.*; "),
    "error above the speed": (
        with_errors(9),
        "row 3, column 'se_m_s': '9' is not smaller than the speed.*; ",
    ),
    "an error missing": (
        with_errors(""),
        "S-3.csv, column 'se_m_s': '' of the push at time_ms .* is empty beside a speed.*; give it",
    ),
    "nothing tells the errors": (
        content(OWN, "{}\n"),
        "S-3.csv.*nothing says how large.*; add a column se_m_s",
    ),
    "fits without R2": (content(OWN, "noise: { fit_points: 12 }\n"), "S-3.csv.*fit_r2.*; "),
    "a beat out of rhythm": (
        pushes(lambda f: beats(f, 1000, 990, 1010, 995, 650)),
        OK + "S-3: 1 of 5 beats are left out: their RR interval lies over 20% from the median",
    ),
    "a rhythm that varies": (
        pushes(lambda f: beats(f, 1000, 990, 1010, 700, 650)),
        OK + "S-3: the rhythm varies: the answer takes every beat for one of 990 ms",
    ),
    "bigeminy": (
        pushes(lambda f: beats(f, 1250, 750, 1250, 750)),
        "median, 1000 ms, as in bigeminy; keep the rows of",
    ),
    "clipped speeds": (
        pushes(lambda f: f.assign(**{SPEED: f[SPEED].astype(float).clip(upper=3.0)})),
        OK + "S-3: .* speeds are the largest of all, 3 m/s: they seem to be clipped",
    ),
    "text in a sample": (wide(set_cell("c 2", "x")), "row 2, column 'c 2': 'x' is not a number; "),
    "a sample in mm/s": (wide(set_cell("c 2", 2100)), "row 2, column 'c 2': '2100' is outside .0.05, 30.; "),
}
KINDS = in_parts(
    CSV=CSV, twice=TWICE, workbook=WORKBOOKS, MATLAB=MATLAB, files=FILES, YAML=YAML, values=VALUES
)


def good(folder: Path) -> Path:
    """Write the cohort without a fault."""
    cohort = free_case.mixed(folder)
    text = (cohort / "recording.yaml").read_text()
    (cohort / "recording.yaml").write_text(text.removesuffix("  phases: 20\n") + "  phases: 20\n")
    return cohort
