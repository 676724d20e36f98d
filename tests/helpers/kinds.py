"""Kinds of files that people have: how each differs from a good cohort, and what is to be said of it.

The good cohort has gated recordings, S-1 and s_2x, and a free-running one, S-3 (``free_case.mixed``). Words
that begin with OK are of recordings that are read; all others of a refusal: its place, value and remedy.
"""

from __future__ import annotations

import os
import zipfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import free_case
import h5py
import numpy as np
import pandas as pd
import yaml
from cohorts import HEADER, ROWS, columns, recording, write_v5, write_v73
from numpy.typing import NDArray
from openpyxl import load_workbook
from openpyxl.comments import Comment
from openpyxl.styles import Font
from openpyxl.worksheet.worksheet import Worksheet
from scipy.io import savemat

Break = Callable[[Path], object]
Change = Callable[[pd.DataFrame], object]
Kinds = list[tuple[Break, str]]
OK = "OK "
SPEED = "shear_wave_speed_m_s"
TRAIN, OWN, GATED = "swe/S-3.csv", "swe/S-3.yaml", "swe/S-1.csv"
SUBJECTS, DESCRIPTION = "subjects.csv", "recording.yaml"
FIRST = ROWS["S-1"]
PERSONS, CLINICAL = "person,visit,group", "sbp_mmhg,dbp_mmhg,lvet_ms"
SHEET = "xl/worksheets/sheet1.xml"
MERGED = '<mergeCells count="1"><mergeCell ref="B2:XFD1048576"/></mergeCells>'
LAST_CELL = '<row r="1048576"><c r="XFD1048576"><v>1</v></c></row>'
MANY_ALIASES = "a0: &a0 [x,x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"a{n + 1}: &a{n + 1} [{','.join([f'*a{n}'] * 10)}]\n" for n in range(8)
)


def both(*breaks: Break) -> Break:
    return lambda cohort: [broken(cohort) for broken in breaks]


def content(name: str, raw: str | bytes) -> Break:
    return lambda cohort: (cohort / name).write_bytes(raw if isinstance(raw, bytes) else raw.encode())


def text(change: Callable[[str], str], name: str = TRAIN) -> Break:
    """Change the text of a file."""
    return lambda cohort: (cohort / name).write_text(change((cohort / name).read_text()), newline="")


def swapped(name: str, old: str, new: str) -> Break:
    """Replace the first of these words in a file."""
    return text(lambda whole: whole.replace(old, new, 1), name)


def added(name: str, line: str) -> Break:
    return text(lambda whole: f"{whole}{line}\n", name)


def moved(name: str, other: str) -> Break:
    return lambda cohort: (cohort / name).rename(cohort / other)


def replaced(make: Callable[[Path], object], name: str = GATED) -> Break:
    """Put something else in the place of a file, which lies outside of the cohort then."""

    def broken(cohort: Path) -> None:
        outside = cohort.parent / "outside"
        outside.mkdir()
        (cohort / name).rename(outside / Path(name).name)
        make(cohort / name)

    return broken


def linked_out(path: Path) -> None:
    """Lead to the file where ``replaced`` has put it."""
    cohort = next(parent for parent in path.parents if parent.name == "cohort")
    path.symlink_to(cohort.parent / "outside" / path.name)


def cell(name: str, column: str, value: object, row: int = 2) -> Break:
    """Set one cell of a table; ``row`` is its line in the file."""

    def change(whole: str) -> str:
        lines = whole.splitlines()
        cells = lines[row - 1].split(",")
        cells[lines[0].split(",").index(column)] = str(value)
        lines[row - 1] = ",".join(cells)
        return "\n".join(lines) + "\n"

    return text(change, name)


def beside(header: str, *cells: str) -> Break:
    """Give subjects.csv further columns, with these cells in its first rows; all subjects are women."""

    def change(whole: str) -> str:
        names, *rows = whole.replace(",M,", ",F,").splitlines()
        filled = [*cells, *[header.count(",") * ","] * len(rows)]
        lines = [f"{row},{own}" for row, own in zip(rows, filled, strict=False)]
        return "\n".join([f"{names},{header}", *lines])

    return text(change, SUBJECTS)


def frame(change: Change, name: str = TRAIN) -> Break:
    """Change the table of a recording, S-3 where no other is named; what is returned takes its place."""

    def broken(cohort: Path) -> None:
        table = pd.read_csv(cohort / name)
        changed = change(table)
        (table if changed is None else changed).to_csv(cohort / name, index=False)

    return broken


def renamed(old: str, new: str, name: str = TRAIN) -> Break:
    return frame(lambda table: table.rename(columns={old: new}), name)


def scaled(column: str, factor: float, name: str = TRAIN) -> Break:
    return frame(lambda table: table.assign(**{column: (table[column] * factor).round(6)}), name)


def mapped(change: Change, **said: object) -> Break:
    """Change the train, and say how it is to be read."""
    return both(frame(change), content(OWN, free_case.NOISE + (yaml.safe_dump(said) if said else "")))


def called(column: str, name: str, **said: object) -> Break:
    """Give a column of the train another name, and say so."""
    return mapped(lambda table: table.rename(columns={column: name}), columns={column: name}, **said)


def failed(*phases: int) -> Break:
    """Let every attempt of S-1 at these phases fail."""

    def change(table: pd.DataFrame) -> None:
        table.loc[table["phase_index"].isin(phases), [SPEED, "status"]] = [np.nan, "motion"]

    return frame(change, GATED)


def copied(first: str, second: str) -> Break:
    """Let rows of S-1 have what others have, both as pandas finds them."""

    def change(table: pd.DataFrame) -> None:
        names = [SPEED, "status", "fit_r2"]
        table.loc[table.eval(second), names] = table.loc[table.eval(first), names].to_numpy()

    return frame(change, GATED)


def another(name: str, write: Callable[[pd.DataFrame, Path], object]) -> Break:
    """Add a subject S-4 whose recording is written from that of S-3."""
    return both(
        lambda cohort: write(pd.read_csv(cohort / TRAIN), cohort / "swe" / name),
        content("swe/S-4.yaml", free_case.NOISE),
        added(SUBJECTS, "S-4,F,25,1.7,60,90,34,0.8"),
    )


def alternating(table: pd.DataFrame, odd: str, even: str) -> NDArray[np.str_]:
    return np.where(np.arange(len(table)) % 2, odd, even)


def with_errors(value: object) -> Break:
    """Give the train standard errors, one of which is ``value``."""

    def change(table: pd.DataFrame) -> pd.DataFrame:
        errors = pd.Series(0.1, table.index).astype(object)
        errors[1] = value
        return table.assign(se_m_s=errors, status="ok", **{SPEED: 2.0 + 0.01 * np.arange(len(table))})

    return frame(change)


def beats(*rr_ms: float) -> Break:
    """Give the train as many beats as these RR intervals, each with those of its own in turn."""

    def change(table: pd.DataFrame) -> pd.DataFrame:
        parts = []
        for number, rr in enumerate(rr_ms):
            part = table[table["beat"] == number % 2]
            time = (part["time_ms"] / part["rr_ms"] * rr).round(1)
            speed = (part[SPEED] * (1.0 + 0.013 * number)).round(3)
            parts.append(part.assign(beat=number, time_ms=time, rr_ms=rr, **{SPEED: speed}))
        return pd.concat(parts)

    return frame(change)


def wide(value: object) -> Break:
    """Write S-1 with a column a sample, one cell of which is ``value``."""

    def broken(cohort: Path) -> None:
        keys = ["phase_index", "trigger_delay_ms", "rr_ms", "repeat"]
        table = recording().pivot_table(index=keys, columns="sample", values=SPEED)
        names = [f"c {name}" for name in table.columns]
        table = table.set_axis(names, axis=1).reset_index().astype(object)
        table.loc[0, "c 2"] = value
        table.to_csv(cohort / GATED, index=False)
        said = {"samples": [{SPEED: name} for name in names], "values": {"fit_r2": 1, "status": "ok"}}
        (cohort / "swe" / "S-1.yaml").write_text(yaml.safe_dump({"table": said}))

    return broken


def book(change: Callable[[Worksheet], object], name: str = TRAIN) -> Break:
    """Put a workbook in the place of a recording, S-3 where no other is named, and change its sheet."""

    def broken(cohort: Path) -> None:
        path, table = (cohort / name).with_suffix(".xlsx"), pd.read_csv(cohort / name)
        (cohort / name).unlink()
        table.to_excel(path, index=False)
        workbook = load_workbook(path)
        change(workbook.active)
        workbook.save(path)

    return broken


def as_book(raw: bytes) -> Break:
    return both(content(TRAIN, raw), moved(TRAIN, "swe/S-3.xlsx"))


def cell_of_book(place: str, attribute: str, value: object) -> Break:
    return book(lambda sheet: setattr(sheet[place], attribute, value))


def formatted(column: str, number_format: str, factor: float, name: str = TRAIN) -> Break:
    """Write a column times a factor, in a number format."""

    def change(sheet: Worksheet) -> None:
        place = [one.value for one in sheet[1]].index(column)
        for row in sheet.iter_rows(min_row=2):
            row[place].value = row[place].value and round(factor * float(row[place].value), 6)
            row[place].number_format = number_format

    return book(change, name)


def part_of_book(part: str, old: str, new: str) -> Break:
    """Put a workbook in the place of the train, with other words in one of its parts."""

    def broken(cohort: Path) -> None:
        book(lambda _: None)(cohort)
        path = (cohort / TRAIN).with_suffix(".xlsx")
        with zipfile.ZipFile(path) as archive:
            parts = {member: archive.read(member) for member in archive.namelist()}
        parts[part] = parts[part].replace(old.encode(), new.encode())
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for member, raw in parts.items():
                archive.writestr(member, raw)

    return broken


def matlab(write: Callable[[Path, pd.DataFrame], object]) -> Break:
    """Put a .mat file in the place of the recording of S-1."""

    def broken(cohort: Path) -> None:
        (cohort / GATED).unlink()
        write((cohort / GATED).with_suffix(".mat"), recording())

    return broken


def pushes_as(write: Callable[[Path, dict[str, object]], object]) -> Break:
    """Put a .mat file in the place of the train, of which the vectors of accepted pushes are given."""

    def broken(cohort: Path) -> None:
        accepted = pd.read_csv(cohort / TRAIN).dropna().drop(columns="status")
        (cohort / TRAIN).unlink()
        write(
            (cohort / TRAIN).with_suffix(".mat"), {str(name): accepted[name].to_numpy() for name in accepted}
        )

    return broken


def vectors(**changed: object) -> Break:
    """Save S-1 as vectors, some of them others."""
    return matlab(lambda path, table: savemat(path, columns(table) | changed))


def hdf5(**rr_ms: object) -> Break:
    """Save S-1 as MATLAB 7.3 does, its RR intervals in a dataset of their own kind."""

    def write(path: Path, table: pd.DataFrame) -> None:
        write_v73(path, table)
        with h5py.File(path, "a") as file:
            del file["rr_ms"]
            file.create_dataset("rr_ms", dtype="f8", **rr_ms)

    return matlab(write)


def truncated(path: Path, table: pd.DataFrame) -> None:
    write_v73(path, table)
    raw = path.read_bytes()
    path.write_bytes(raw[: int(0.7 * len(raw))])


gated = partial(frame, name=GATED)
context, of_s1, push = partial(cell, SUBJECTS), partial(cell, GATED, row=6), partial(cell, TRAIN)
said, of_all, further = partial(content, OWN), partial(content, DESCRIPTION), partial(added, DESCRIPTION)


SUBJECT_TABLE: Kinds = [
    (context("hr_bpm", "fast"), "subjects.csv, row 2, column 'hr_bpm': 'fast' is not a number"),
    (context("lvedv_ml", "NaN"), "'lvedv_ml': 'NaN' is not a number"),
    (context("bsa_m2", ""), "column 'bsa_m2': '' is not a number"),
    (context("bsa_m2", "-1.7"), "column 'bsa_m2': '-1.7' is outside .0.1, 4.; .*m2"),
    (context("ivsd_cm", "8"), "column 'ivsd_cm': '8' is outside .0.2, 3.; .*in cm"),
    (context("lvedv_ml", "0.09"), "column 'lvedv_ml': '0.09' is outside .10, 500.; .*mL"),
    (context("hr_bpm", "1"), "column 'hr_bpm': '1' is outside .30, 220.; .*beats per minute"),
    (context("lvesv_ml", "3.4"), "column 'lvesv_ml': '3.4' .*fraction of 0.96, expected 0.03 to 0.9"),
    (context("lvesv_ml", "90"), "column 'lvesv_ml': '90' .*must be below lvedv_ml .*swapped"),
    (context("sex", "female"), "column 'sex': 'female' is refused: .*; write F or M"),
    (context("subject", "../S-1"), r"'subject': '\.\./S-1' is refused.*letters, digits"),
    (context("subject", "S 1"), "column 'subject': 'S 1' is refused.*letters, digits"),
    (context("subject", ""), "column 'subject': '' is refused.*letters, digits"),
    (context("subject", "S" * 300), "column 'subject': 'S{60}...' is refused"),
    (beside(CLINICAL, "118,,"), "row 2, column 'sbp_mmhg': '118' is given without dbp_mmhg; give both"),
    (beside(CLINICAL, ",74,"), "row 2, column 'dbp_mmhg': '74' is given without sbp_mmhg; give both"),
    (beside(CLINICAL, "118,118,"), "column 'dbp_mmhg': '118' is not below sbp_mmhg of .*; .*swapped"),
    (beside(CLINICAL, "118,9.9,"), r"'dbp_mmhg': '9.9' is outside \[30, 160\]; .*in mmHg, not kPa"),
    (beside(CLINICAL, "1180,74,"), "column 'sbp_mmhg': '1180' is outside .*; correct .*in mmHg, not kPa"),
    (beside(CLINICAL, ",,0.295"), r"'lvet_ms': '0.295' is outside \[100, 500\]; .*in ms, not s"),
    (beside(CLINICAL, ",,1000"), "'lvet_ms': '1000' is outside"),
    (beside(CLINICAL, "118,low,"), "column 'dbp_mmhg': 'low' is not a number; write .* or nothing"),
    (beside(CLINICAL, "118,inf,"), "column 'dbp_mmhg': 'inf' is not a number"),
    (beside("sbp", "118"), "'sbp': is not read, and looks like sbp_mmhg; call it sbp_mmhg, in mmHg"),
    (beside("sbp_kpa,dbp_kpa", "15,9"), "looks like sbp_mmhg.*\n.*looks like dbp_mmhg"),
    (beside(f"{CLINICAL},lvet_ms", "118,74,300,300"), "names a column twice: lvet_ms"),
    (beside(PERSONS, "P,1,", "P,1,"), "row 3, column 'visit': '1' is the name of an earlier visit of the"),
    (beside(PERSONS, "P,One,", "Q,one,", "P,one,"), "row 4, column 'visit': 'one' is the name of an earli"),
    (beside(PERSONS, "P,1,", ",2,"), "row 3, column 'visit': '2' is given without person; name the person"),
    (beside(PERSONS, "P,1,", "P,,"), "row 3, column 'person': 'P' has several rows, of which this one nam"),
    (beside("person", "P", "P"), r"row 2, column 'person': 'P' has several(.|\n)*row 3, column 'person'"),
    (beside(PERSONS, "P,1,a", "P,2,b"), "row 3, column 'group': 'b' is not the group in the first row"),
    (beside(PERSONS, "P,1,", "p,2,"), "row 3, column 'person': 'p' differs from an earlier person in case"),
    (beside(PERSONS, "P,,drug", "Q,,Drug"), "row 3, column 'group': 'Drug' differs from an earlier group"),
    (beside("group", "All"), "row 2, column 'group': 'All' is what tables of groups call all persons"),
    (beside("person", "", "s-1"), "row 2, column 'subject': 'S-1' is the name of a person in other rows"),
    (beside("Person", "P"), "column 'Person': is not read, and looks like person; call it person"),
    (beside("persn", "P"), "looks like person"),
    (beside(PERSONS, "2024/001,1,"), "column 'person': '2024/001' has a sign .* folder, .* write '-' in"),
    (beside("person", "=1+1"), "'=1.1' begins with neither a letter nor a digit; put one first"),
    (beside("person", "changes.csv"), "'changes.csv' ends as files of results do"),
    (beside("person", "ж" * 65), "'ж{60}...' has more than 64 characters; shorten it"),
    (beside("person", "漢" * 64), "is too long for a folder"),
    (beside(PERSONS, "P,be\u200bfore,"), r"'visit': 'be\\u200bfore' .with U\+200B. has a sign that cannot"),
    (beside("group", "\x1b[2Jdrug"), r"'group': '\\x1b\[2Jdrug' .with U\+001B. has a sign that cannot"),
    (beside("person", "Müller", "Mu\u0308ller"), "row 3, column 'person': 'M.+ller' differs from an ear"),
    (swapped(SUBJECTS, ",bsa_m2", ",BSA_m2"), "row 1: lacks the columns bsa_m2; .*'BSA_m2' should be 'bsa"),
    (swapped(SUBJECTS, "ivsd_cm", "ivsd_cm,sex"), "names a column twice: sex; rename"),
    (content(SUBJECTS, HEADER), "subjects.csv: holds no data row; write"),
    (content(SUBJECTS, ""), "subjects.csv: is empty|row 1: lacks the columns"),
    (swapped(SUBJECTS, FIRST, f"{FIRST}\n{FIRST}"), "row 3, column 'subject': 'S-1' repeats"),
    (swapped(SUBJECTS, "s_2x", "s-1"), "row 3.*'s-1' differs .* in case, zeros"),
    (swapped(SUBJECTS, FIRST, FIRST[:-4]), "row 2: has 7 cells, the header has 8; .*complete"),
    (swapped(SUBJECTS, "90,34", "14,5.4"), r"'lvedv_ml': '14' .*over bsa_m2 \(1.7\) is 8.24 mL/m2, expected"),
    (
        swapped(SUBJECTS, "90,34", "34,90"),
        "row 2, column 'lvesv_ml': '90' .*must be below lvedv_ml .34.*swapped",
    ),
    (swapped(SUBJECTS, "lvesv_ml", "lvef_percent"), r"lacks the columns lvesv_ml; it has [^()]*; name them"),
    (
        content(SUBJECTS, (HEADER + ",größe\n").encode("latin-1")),
        r"cannot be read as UTF-8 text \(byte \d+\); save it as CSV in UTF-8",
    ),
    (content(SUBJECTS, "PK\x03\x04..."), "is an Excel workbook; save the sheet as 'CSV"),
    (
        both(lambda cohort: (cohort / SUBJECTS).unlink(), content("swe/_notes.csv", "")),
        r"cohort: 1 problem\n  - .*subjects.csv: no such file; put the",
    ),
    (both(beside("lvet_ms", "340"), context("hr_bpm", "180")), "row 2, .*'340' is no shorter than a beat"),
    (beside(PERSONS, "P,1,g", "P,2,g"), OK + "persons: 2, by number of visits: 1 with 1, 1 with 2"),
]

GATED_TABLE: Kinds = [
    (of_s1(SPEED, "1.2 m/s"), f"S-1.csv, row 6, column '{SPEED}': '1.2 m/s' is not a number"),
    (of_s1(SPEED, "-inf"), "row 6, .*'-inf' is not a number"),
    (of_s1(SPEED, "-1.2"), "'-1.2' is outside .*; give it in m/s"),
    (of_s1(SPEED, "1,5"), "S-1.csv, row 6: has 9 cells, the header has 8; .*commas"),
    (of_s1(SPEED, '"1,5"'), "'1,5' is not a number; .*decimal point"),
    (of_s1("status", "OK"), "row 6, column 'status': 'OK' is none of ok, no_wave, motion"),
    (of_s1("phase_index", "1.5"), "row 6, column 'phase_index': '1.5' is not a whole number"),
    (scaled(SPEED, 100.0, GATED), f"column '{SPEED}': .* is outside .0.05, 30.; give it in m/s"),
    (scaled(SPEED, 0.1, GATED), "median shear-wave speed is 0.1.* m/s, expected 0.5 to 10"),
    (scaled("rr_ms", 1e-3, GATED), "column 'rr_ms': .* is outside .150, 5000.; give the RR interval in ms"),
    (scaled("trigger_delay_ms", 1e-3, GATED), "the longest trigger delay is 0.975 ms, and reaches 0.001"),
    (scaled("trigger_delay_ms", 0.1, GATED), "the longest trigger delay is 97.5 ms, .*late diastole"),
    (scaled("trigger_delay_ms", 1.5, GATED), "phase_index 19 lies at 1.46 of its .* after its end; check"),
    (scaled("fit_r2", 100.0, GATED), "column 'fit_r2': .* is outside .-1, 1.; R2 is a fraction"),
    (failed(1, 4, 7, 10, 13), "25% of the phases are missing, limit 20% .15 of the 20"),
    (failed(8, 9, 10), "no phase was measured for 0.200 of the cycle after 0.375, limit"),
    (failed(16, 17), "1 phases were measured in late diastole, .0.8, 0.97. .* needs 2"),
    (failed(*range(20)), "no sample is acceptable .no_wave .*, motion .*; record again"),
    (
        gated(lambda _: recording(phases=12)),
        "its 12 phases fill the cycle, but recording.phases in config.yaml is 20: .*if 12 were",
    ),
    (
        gated(lambda _: recording(phases=24)),
        "'20' is outside .0, 19.; recording.phases in config.yaml is 20, .*by --phases or",
    ),
    (renamed("rr_ms", "RR_ms", GATED), "lacks the columns rr_ms; .*'RR_ms' should"),
    (swapped(GATED, "sample", "rr_ms"), "S-1.csv, row 1: names a column twice: rr_ms"),
    (content(GATED, ""), "S-1.csv: is empty|S-1.csv, row 1: lacks"),
    (gated(lambda f: f.assign(**{SPEED: f[SPEED].clip(upper=2.9) * 10.0})), "median .* m/s, .* 10; check"),
    (gated(lambda f: f.assign(youngs_modulus_kpa=5.0)), "has both of|has .* and youngs_modulus_kpa; name"),
    (gated(lambda f: f.assign(youngs_modulus_kpa=3e3 * f.pop(SPEED) ** 2)), "outside .0.0075, 2700.; .*kPa"),
    (swapped(SUBJECTS, "1.7,60", "1.7,95"), r"RR interval is 1000 ms .* of S-1 .* is 95 \(632"),
    (
        gated(lambda f: pd.concat([f, f[4:5]])),
        "row 722, column 'sample': '4' repeats the phase_index, repeat, sample of .*; keep one",
    ),
    (
        copied("phase_index == 4 & repeat == 0", "phase_index == 4 & repeat == 2"),
        "repeat 2 .* as repeat 0 of",
    ),
    (copied("phase_index == 4", "phase_index == 5"), "phase_index 5 has the same .* of phase_index 4"),
    (gated(lambda f: f.assign(phase_index=f["phase_index"] + 1)), "'20' .*say `first_phase: 1`"),
    (
        gated(lambda f: f[f["phase_index"] != 5].replace({"phase_index": {3: 12, 12: 3}})),
        "phase_index 5 has no row, and the others do not follow the order of the cycle; add a row",
    ),
    (gated(lambda f: f.replace({"trigger_delay_ms": {125.0: 75.0}})), "the same phase 0.0750; check trigger"),
    (
        text(lambda t: t.replace(",", ";").replace("0.95", "0,95", 1), GATED),
        "row 2, .*'0,95' has .*; use one",
    ),
    (swapped(GATED, "ok", "ok\n"), "row 3: has 0 cells, the header has 8; remove blank lines"),
    (content(GATED, "phase_index\0,rr_ms\n"), "holds zero bytes, so is no text"),
    (content(GATED, b"\xd0\xcf\x11\xe0"), "is an Excel workbook; save"),
    (wide("x"), "row 2, column 'c 2': 'x' is not a number"),
    (wide(2100), "row 2, column 'c 2': '2100' is outside .0.05, 30."),
    (gated(lambda f: f.assign(**{SPEED: 2.0})), "every phase has the same speed, 2 m/s"),
    (
        gated(lambda f: f.assign(phase_index=(f["phase_index"] + (f["repeat"] == 1)) % 20)),
        r"S-1.csv, row 1\d, column 'trigger_delay_ms': .*about a gate from",
    ),
    (gated(lambda f: f[f["sample"] == 0]), "; a phase needs 6 samples .*, and none has more than 3: give"),
    (gated(lambda f: f[f["repeat"] == 0]), "; a phase needs 2 repeats .*, and none has more than 1: record"),
]

TRAIN_TABLE: Kinds = [
    (push("time_ms", "early"), "S-3.csv, row 2, column 'time_ms': 'early' is not a number; "),
    (push("time_ms", -4), "row 2, column 'time_ms': '-4' is outside .0, 5000."),
    (push("time_ms", 1900), "'time_ms': '1900' lies after the end of its beat"),
    (push("rr_ms", 0.98), "row 2, column 'rr_ms': '0.98' is outside .150, 5000."),
    (push("rr_ms", "1\u202f000"), r"row 2, column 'rr_ms': .* \(with U\+202F\) is not a number"),
    (push("beat", 0.5), "row 2, column 'beat': '0.5' is not a whole number"),
    (push(SPEED, 210), f"row 2, column '{SPEED}': '210' is outside .0.05, 30."),
    (push("status", "good"), "row 2, column 'status': 'good' is none of ok"),
    (push("status", "ok\u200b"), r"'status': 'ok.u200b' \(with U\+200B\) is none of ok"),
    (scaled("time_ms", 0.001), "column 'time_ms': the latest push is 1 ms after its R peak; check the unit"),
    (
        scaled(SPEED, 0.1),
        "S-3.csv, .*median shear-wave speed is 0.195 m/s, expected 0.5 to 10; check the unit",
    ),
    (with_errors(0), "row 3, column 'se_m_s': '0' is no standard error"),
    (with_errors(-0.2), r"column 'se_m_s': '-0.2' is outside \[0, 30\]"),
    (with_errors(9), "row 3, column 'se_m_s': '9' is not smaller than the speed"),
    (with_errors(""), "column 'se_m_s': '' of the push at time_ms .* is empty beside a speed.*; give it"),
    (renamed("status", "Status"), "column 'Status': is not read, and looks like status"),
    (renamed("beat", "Beat"), "column 'Beat': is not read, and looks like beat"),
    (renamed("rr_ms", "rr"), "'rr' should be 'rr_ms'"),
    (renamed("status", "rr_ms"), "names a column twice: rr_ms"),
    (renamed("time_ms", "\u200btime_ms"), r"'.u200btime_ms' should be 'time_ms' \(with U\+200B\)"),
    (renamed("rr_ms", "rr\u00ad_ms"), r"should be 'rr_ms' \(with U\+00AD\)"),
    (renamed(SPEED, "speed"), "S-3.csv.* has none of the columns"),
    (beats(1000, 990, 1010, 995, 650), OK + "S-3: 1 of 5 beats are left out: their RR .* over 20% from"),
    (beats(1000, 990, 1010, 700, 650), OK + "S-3: the rhythm varies: .* every beat for one of 990 ms"),
    (beats(1250, 750, 1250, 750), "median, 1000 ms, as in bigeminy; keep the rows of"),
    (text(lambda t: t.replace(",", "|")), "lacks the columns .*; separate the columns by commas, semicolons"),
    (text(lambda t: t.replace(",", " ")), "lacks the columns .*; separate the columns by commas, semicolons"),
    (
        both(frame(lambda f: f.assign(remark="late")), text(lambda t: '"late'.join(t.rsplit("late", 2)))),
        r"row \d+: has a quote that .* does not close it in the same row",
    ),
    (text(lambda t: t.replace("\n", '\n"', 9).replace('"', "", 8)), "row 10: has a quote that"),
    (swapped(TRAIN, ",ok", ',"ok"x'), "has text behind a closing quote"),
    (swapped(TRAIN, "ok", "A" * 140_000), r"S-3.csv, row \d+: cannot be read"),
    (text(lambda t: t.replace("\n", '\n"r",').removesuffix('"r",')), "row has a first cell .*R writes row"),
    (text(lambda t: t.replace("\n", ",\n").replace(",\n", "\n", 1)), "rows end in a delimiter, and"),
    (swapped(TRAIN, "\n", ",\n"), "S-3.csv: the row of names ends in a delimiter"),
    (frame(lambda f: f.assign(Unit=alternating(f, "m/s", "kPa"))), "'kPa, m/s' states units row by row"),
    (both(called(SPEED, "c"), frame(lambda f: f.assign(Unit="cm/s"))), "'cm/s' states units row by row"),
    (both(called(SPEED, "c"), frame(lambda f: f.assign(Unit="m/s"))), OK),
    (frame(lambda f: f.assign(view=alternating(f, "A4C", "PLAX"))), OK + "S-3: not used, though .*: view"),
    (frame(lambda f: f.assign(se_ms=0.1)), "column 'se_ms': is not read, and looks like se_m_s"),
    (text(lambda t: t.replace("\n", "\n#", 2)), OK + "S-3: rows that begin with # are left out: 2, 3"),
    (text(lambda t: "Export of a scanner\n\n" + t), "row 1: has 1 cells, .*; .*`table: { header_row: 3 }`"),
    (added(TRAIN, "Exported by a scanner"), "row 64: has 1 cells, the header has 5; remove blank lines and"),
    (frame(lambda f: pd.concat([f, f[f["beat"] == 0].assign(beat=7)])), "beat 7 has the same .* as beat 0"),
    (mapped(lambda f: pd.concat([f, f[f["beat"] == 0].assign(beat=7)]), table={"copies_allowed": True}), OK),
    (another("S-4.csv", pd.DataFrame.to_csv), "S-4.csv, .*same speeds as .* S-3"),
    (another("S-4.xlsx", lambda f, path: f[::-1].to_excel(path)), "S-4.xlsx, .*same speeds as .* S-3"),
    (frame(lambda f: pd.concat([f, f[:1].assign(rr_ms=977.0, **{SPEED: 1.7})]).drop(columns="beat")), OK),
    (
        frame(lambda f: pd.concat([f, f[:1].assign(**{SPEED: 1.7})]).drop(columns="beat")),
        "repeats .*; number the",
    ),
    (frame(lambda f: pd.concat([f, f[:1]])), "repeats the beat, time_ms of an earlier row"),
    (frame(lambda f: f.assign(time_ms=100 * f["time_ms"] / f["rr_ms"])), "can be per cent of the beat"),
    (called("time_ms", "t (% RR)"), "'t .% RR.': states %, and time_ms is read in ms"),
    (called(SPEED, "c (kPa)"), "states kPa, .*; map it to youngs_modulus_kpa or"),
    (called(SPEED, "c (cm/s)", units={SPEED: "mm/s"}), "states cm/s, and .* is mm/s; correct one"),
    (frame(lambda f: f.assign(**{SPEED: 3 * f[SPEED] ** 2})), "30.; .*kPa are for the column youngs_modulus"),
    (frame(lambda f: f.assign(rr_ms=500.0, time_ms=f["time_ms"] / 2.1)), "median RR interval is 500 ms"),
    (frame(lambda f: f[:1].assign(**{SPEED: 2.0, "status": "ok"})), "1 pushes are acceptable of 1 .*needs 2"),
    (frame(lambda f: f.assign(status="no_wave")), "0 pushes are acceptable of 62 .no_wave 62."),
    (frame(lambda f: f[:0]), "S-3.csv: holds no data row"),
    (frame(lambda f: f.assign(event="mvc")), "'event': says what set off each wave"),
    (
        frame(lambda f: f.assign(phase_index=0)),
        "S-3.csv, row 1: lacks the columns trigger_delay_ms, .*; name them in",
    ),
    (frame(lambda f: f.assign(fit_r2=90)), r"'fit_r2': '90' is outside \[-1, 1\]"),
    (frame(lambda f: f.assign(**{SPEED: f[SPEED].clip(upper=3.0)})), OK + "S-3: .*, 3 m/s: they seem"),
    (added(TRAIN, "1,2"), "S-3.csv, row 64: has 2 cells, the header has 5; .*complete the row"),
]

WORKBOOKS: Kinds = [
    (formatted("fit_r2", '0.0"%"', 100.0, GATED), OK),
    (formatted("fit_r2", "0%", 1.0, GATED), OK),
    (formatted("rr_ms", "0.0,", 1000.0), OK),
    (formatted(SPEED, '0.0" cm/s"', 100.0), f"column '{SPEED}': '.* cm/s' is not a number"),
    (formatted(SPEED, ";;;", 1.0), r"row \d+, column .*: '[0-9.]+' is hidden by its number format; delete"),
    (formatted(SPEED, '[>2]"high";0.0', 1.0), "'[0-9.]+high' is not a number"),
    (cell_of_book("B4", "font", Font(strike=True)), "row 4, column 'rr_ms': .* is struck through"),
    (cell_of_book("D5", "comment", Comment("odd?", "A")), OK + "S-3: notes at cells are not read: D5 'odd"),
    (cell_of_book("B5", "value", "=1+1"), "row 5, .*'=1.1' is a formula whose value"),
    (
        cell_of_book("A2", "value", pd.Timestamp("2026-01-02").to_pydatetime()),
        "S-3.xlsx.*time_ms.*2026-01-02",
    ),
    (
        part_of_book(
            "xl/workbook.xml",
            "http://schemas.openxmlformats.org/spreadsheetml/2006/main",
            "http://purl.oclc.org/ooxml/spreadsheetml/main",
        ),
        "S-3.xlsx: is a 'Strict Open XML Spreadsheet'; save it as",
    ),
    (part_of_book(SHEET, "</sheetData>", f"</sheetData>{MERGED}"), "more than 500000 cells"),
    (part_of_book(SHEET, "</sheetData>", f"{LAST_CELL}</sheetData>"), "more than 500000 cells"),
    (book(lambda sheet: setattr(sheet.column_dimensions["B"], "hidden", True)), "'rr_ms': is hidden; delete"),
    (
        both(
            frame(lambda f: f.assign(x=1)), book(lambda s: setattr(s.column_dimensions["F"], "hidden", True))
        ),
        OK,
    ),
    (
        book(lambda sheet: setattr(sheet.row_dimensions[5], "hidden", True)),
        "1 hidden rows .* first of them 5",
    ),
    (book(lambda sheet: sheet.merge_cells("B3:B9")), "row 3, column 'rr_ms': has merged cells"),
    (
        book(lambda sheet: sheet.parent.copy_worksheet(sheet)),
        "has 2 sheets with rows: Sheet1, Sheet1 Copy; name",
    ),
    (book(lambda sheet: sheet.delete_rows(1, 99)), "S-3.xlsx: has 0 sheets with rows: none; name the one"),
    (as_book(b"\xd0\xcf\x11\xe0" + b"\0" * 600), "of the old form, or one that a password protects; save it"),
    (as_book(b"PK\x03\x04 no"), "cannot be read as a workbook"),
]

MATLAB: Kinds = [
    (matlab(lambda path, _: path.write_text("phase_index")), "S-1.mat: cannot be read as a .mat"),
    (matlab(lambda path, _: path.write_text("# Created by Octave 8.4\n")), r"is text, as Octave saves it"),
    (matlab(truncated), "S-1.mat: cannot be read as a .mat file"),
    (matlab(lambda path, f: write_v5(path, f.drop(columns="rr_ms"))), "lacks the columns rr_ms; it has"),
    (
        matlab(lambda path, f: savemat(path, {name.upper(): own for name, own in columns(f).items()})),
        "'PHASE_INDEX' should be 'phase_index'",
    ),
    (vectors(rr_ms=np.ones((20, 36))), "column 'rr_ms': is an array of 20 x 36; save one value"),
    (vectors(rr_ms=np.ones(9)), r"its vectors differ in length \(.*rr_ms 9.*; give"),
    (vectors(**{SPEED: np.ones(720) * 1j}), f"'{SPEED}': is complex; save it as a real"),
    (vectors(status=np.array([1.0, "ok"], dtype=object)), "'status': has a cell that is no text"),
    (matlab(lambda path, f: write_v5(path, f[:0])), "its vectors are empty; save"),
    (
        matlab(lambda path, f: savemat(path, {"a": columns(f), "b": columns(f)})),
        r"S-1.mat: holds several recordings \(a, b\); save one struct a file",
    ),
    (hdf5(shape=(1, 720), external=[("/dev/zero", 0, 8 * 720)]), "'rr_ms': .* in another file; save"),
    (hdf5(shape=(4_000_000, 400), chunks=(1000, 400)), "'rr_ms': has more values than a recording"),
    (pushes_as(lambda path, found: savemat(path, found | {"prf": 30.0, "image": np.ones((9, 9))})), OK),
    (pushes_as(lambda path, found: h5py.File(path, "w").update(found)), OK),
    (matlab(lambda path, f: write_v5(path, f.assign(rr_ms=1.0))), "element 1, column 'rr_ms': '1' is outs"),
]

FILES: Kinds = [
    (
        replaced(lambda _: None),
        r"swe: there is no file S-1.csv, .*S-1.xlsm; put it there, or take the subject out",
    ),
    (moved(TRAIN, "swe/S-3.CSV"), OK),
    (moved(TRAIN, "swe/s-3.csv"), "but there is s-3.csv; call the subject s-3, or the file S-3"),
    (moved(TRAIN, "swe/S-03.csv"), "but there is S-03.csv; call the subject S-03, or the"),
    (moved(TRAIN, "swe/S-3.dta"), "S-3.dta: is of a statistics program; read it in Python, by swesbi"),
    (moved(TRAIN, "swe/S-3.parquet"), "S-3.parquet: is no table; read it in Python, by swesbi.rec"),
    (moved(TRAIN, "swe/S-3.csv.gz"), "S-3.csv.gz: is packed; unpack it"),
    (moved(GATED, "swe/S-1.ods"), "S-1.ods: is a workbook; save the sheet as 'CSV UTF-8'"),
    (moved("swe", "SWE"), "swe: is no folder, but there is SWE; call it swe"),
    (moved(DESCRIPTION, "recording.yml"), "no such file, but there is recording.yml; call it"),
    (moved(SUBJECTS, "Subjects.csv"), "no such file, but there is Subjects.csv; call it"),
    (moved(SUBJECTS, "subjects.xlsx"), "but there is subjects.xlsx; save it as subj"),
    (moved("", "../gone"), "cohort: is no folder; correct|no such file"),
    (lambda _: None, OK + "3 recordings can be used; origin: synthetic recordings"),
    (both(text(lambda t: t.replace(",", "\t")), moved(TRAIN, "swe/S-3.tsv")), OK),
    (
        lambda cohort: write_v5(cohort / "swe" / "S-1.mat", recording()),
        "S-1.mat beside S-1.csv; keep the one",
    ),
    (replaced(Path.mkdir), "S-1.csv: is no regular file; put the file itself there"),
    (replaced(os.mkfifo), "S-1.csv: is no regular file; put the file itself there"),
    (replaced(lambda path: path.symlink_to("gone.csv")), "S-1.csv: no such file"),
    (replaced(lambda path: path.symlink_to(path.name)), "S-1.csv: no such file; put"),
    (replaced(linked_out), "S-1.csv: is reached by a link that leads out of the cohort; copy"),
    (replaced(linked_out, "swe"), "S-1.csv: is reached by a link that leads out"),
    (replaced(linked_out, SUBJECTS), "subjects.csv: is reached by a link that"),
    (both(moved(GATED, "raw.csv"), lambda cohort: (cohort / GATED).symlink_to(cohort / "raw.csv")), OK),
    (
        both(
            moved("swe/s_2x.csv", "all.csv"),
            further("columns: { subject: Patient }\ntable: { file: all.csv }"),
        ),
        "all.csv, row 1: lacks the columns Patient",
    ),
]

DESCRIPTIONS: Kinds = [
    (moved(DESCRIPTION, "elsewhere"), "recording.yaml: no such file; put"),
    (of_all("origin:\n"), "has no text under the key `origin`; say"),
    (said("noise: {\n"), "S-3.yaml.*cannot be read as YAML"),
    (said("- 1\n"), "S-3.yaml: holds list, expected keys with values"),
    (said(b"\xff\xfe\x00n"), "S-3.yaml: cannot be read as YAML"),
    (said(MANY_ALIASES), "S-3.yaml: has more than 100000 values, its aliases counted"),
    (said("noise: " + "[" * 5000), "S-3.yaml: is more than 60 levels deep"),
    (said(free_case.NOISE * 2), "S-3.yaml: has the key 'noise' twice, in lines 1 and 2; keep one"),
    (said("noise: { cv_fraction: 0.1, cv_log_sd: 0.3, cv_fraction: 0.2 }\n"), "'cv_fraction' twice"),
    (said("noises: 3\n"), "has the key `noises`, which is not known; did you mean `noise`"),
    (said("phases: 24\n"), "has the key `phases`, which is not known; did you mean `protocol.phases`"),
    (said("protocol: { phases: 024 }\n"), "'024' under the key `protocol.phases`: .* a valid integer"),
    (said("protocol: { phases: 2 }\n"), "S-3.yaml: '2' .*`protocol.phases`"),
    (said("{}\n"), "S-3.csv.*nothing says how large.*; add a column se_m_s"),
    (said("noise: { cv_fraction: 0.1 }\n"), "S-3.yaml.*belong together"),
    (said("noise: { fit_points: 12, cv_fraction: 0.1, cv_log_sd: 0.3 }\n"), "S-3.yaml.*keep one"),
    (said("noise: { fit_points: 2 }\n"), "`noise.fit_points`"),
    (
        said("noise: { fit_points: 12 }\n"),
        "S-3.csv, column 'fit_r2': '' of the push at time_ms 58.82 .*; give it",
    ),
    (said("noise: { cv_fraction: 5, cv_log_sd: 0.3 }\n"), "`noise.cv_fraction`"),
    (said("columns: { speed: x }\n"), "`columns.speed`: is none of subject, phase_index"),
    (said("columns: { shear_wave_speed_se_m_s: x }\n"), "means with standard errors of"),
    (said("columns: { repeat: [a, b] }\n"), "`columns.repeat`: Input should be a valid str"),
    (said(f"columns: {{ {SPEED}: c, youngs_modulus_kpa: E }}\n"), "`columns`: .* name the one that was"),
    (said(f"columns: {{ {SPEED}: 'SWS *' }}\n"), "lacks the columns SWS .*`table.samples`"),
    (said(f"units: {{ {SPEED}: km/h }}\n"), "'km/h' is none of m/s, cm/s, mm/s"),
    (said('units: { repeat: "1" }\n'), "`units.repeat`: is none of"),
    (said("table: { file: all.csv }\n"), "no column says whose a row is"),
    (said("table: { first_phase: 2 }\n"), "`table.first_phase`"),
    (said("table: { statuses: { good: fine } }\n"), "'fine' .*`table.statuses.good`"),
    (said("table: { values: { speed: 1 } }\n"), "`table.values.speed`: is none of"),
    (said("table: { values: { repeat: counted } }\n"), "only phase_index and sample can"),
    (said(f"table: {{ samples: [{{ {SPEED}: a, fit_r2: b }}, {{ {SPEED}: c }}] }}\n"), "the same columns of"),
    (said(f"columns: {{ {SPEED}: a }}\ntable: {{ values: {{ {SPEED}: 1 }} }}\n"), "is said twice; keep"),
    (of_all("a: [1\n"), "recording.yaml: cannot be read as YAML"),
    (of_all("a: 2001-99-99\n"), "has the key `a`, which is not known"),
    (of_all('origin: "a\\e[2J"\n'), "under the key `origin` has a sign that cannot be seen; type"),
    (of_all("origin: a\nprotocol: x\n"), "under the key `protocol`: Input should be"),
    (of_all("origin: a\ndensity_kg_m3: 1060\n"), "density_kg_m3 is 1060, but .* is 1000; corr"),
    (of_all("origin: a\nprotocol: {phases: 12}\n"), "phases is 12, but .* in config.yaml is 20; correct the"),
    (further("  probes: x"), "`protocol.probes`, which is not known; did you mean `protocol.probe`"),
    (further("ward: 7"), "`ward`, which is not known; .*under the key `sources`"),
    (further("sources: { ward: 7 }"), OK),
    (further("repeats_are: sweeps"), "did you mean `protocol.repeats_are`"),
    (further("  repeat_are: sweeps"), "did you mean `protocol.repeats_are`"),
    (further("  repeats_are: both"), "'separate' or 'sweeps'"),
    (
        mapped(
            lambda f: f.replace({"status": {"ok": "yes", "no_wave": "no"}}),
            table={"statuses": {"yes": "ok", "no": "no_wave"}},
        ),
        OK,
    ),
    (
        both(lambda cohort: (cohort / OWN).unlink(), lambda c: (c / OWN).mkdir()),
        "S-3.yaml: is no regular file; put the",
    ),
]

KINDS = {
    f"{part} {number}: {words:.40}": (broken, words)
    for part, kinds in {
        "subjects": SUBJECT_TABLE,
        "gated": GATED_TABLE,
        "MATLAB": MATLAB,
        "files": FILES,
        "descriptions": DESCRIPTIONS,
        "free-running": TRAIN_TABLE,
        "workbooks": WORKBOOKS,
    }.items()
    for number, (broken, words) in enumerate(kinds)
}
