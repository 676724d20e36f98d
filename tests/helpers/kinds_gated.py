"""Kinds of faults of gated recordings, of subjects.csv and of the files of a cohort, as :mod:`kinds`."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
from cohorts import HEADER, ROWS, columns, recording, write_v5, write_v73
from kinds import GATED, SPEED, Break, Kinds, content, in_parts, pushes
from scipy.io import savemat

FIRST = ROWS["S-1"]


def subjects(old: str, new: str) -> Break:
    """Replace text in subjects.csv."""

    def broken(cohort: Path) -> None:
        path = cohort / "subjects.csv"
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new, 1))

    return broken


def context(column: str, value: str) -> Break:
    """Set one value of S-1 in subjects.csv."""
    cells = FIRST.split(",")
    cells[HEADER.split(",").index(column)] = value
    return subjects(FIRST, ",".join(cells))


def table(change: Callable[[pd.DataFrame], pd.DataFrame]) -> Break:
    """Change the recording of S-1 as a whole."""
    return pushes(change, GATED)


def scaled(column: str, factor: float) -> Break:
    return table(lambda frame: frame.assign(**{column: frame[column] * factor}))


def modulus(unit_per_kpa: float) -> Break:
    def change(frame: pd.DataFrame) -> pd.DataFrame:
        values = 3.0 * frame.pop(SPEED) ** 2 * unit_per_kpa
        return frame.assign(youngs_modulus_kpa=values)

    return table(change)


def cell(column: str, value: str, row: int = 6) -> Break:
    """Set one cell of the recording of S-1; ``row`` is its line in the file."""

    def broken(cohort: Path) -> None:
        path = cohort / "swe" / "S-1.csv"
        lines = path.read_text().splitlines()
        cells = lines[row - 1].split(",")
        cells[lines[0].split(",").index(column)] = value
        lines[row - 1] = ",".join(cells)
        path.write_text("\n".join(lines) + "\n")

    return broken


def failed(*phases: int) -> Break:
    """Let every attempt at these phases fail."""

    def change(frame: pd.DataFrame) -> pd.DataFrame:
        chosen = frame["phase_index"].isin(phases)
        frame.loc[chosen, SPEED] = np.nan
        frame.loc[chosen, "status"] = "motion"
        return frame

    return table(change)


def matlab(write: Callable[[Path], object]) -> Break:
    """Put a .mat file in the place of the recording of S-1."""

    def broken(cohort: Path) -> None:
        (cohort / "swe" / "S-1.csv").unlink()
        write(cohort / "swe" / "S-1.mat")

    return broken


def truncated(write: Callable[[Path, pd.DataFrame], None], share: float) -> Callable[[Path], object]:
    def cut(path: Path) -> None:
        write(path, recording())
        raw = path.read_bytes()
        path.write_bytes(raw[: int(share * len(raw))])

    return cut


def replaced(make: Callable[[Path], object], name: str = "swe/S-1.csv") -> Break:
    """Put something else in the place of a file."""

    def broken(cohort: Path) -> None:
        path = cohort / name
        outside = cohort.parent / "outside"
        outside.mkdir()
        path.rename(outside / path.name)
        make(path)

    return broken


def linked_out(path: Path) -> None:
    """Lead to the file where ``replaced`` has put it."""
    cohort = next(parent for parent in path.parents if parent.name == "cohort")
    path.symlink_to(cohort.parent / "outside" / path.name)


def external(path: Path) -> None:
    write_v73(path, recording())
    with h5py.File(path, "a") as file:
        del file["rr_ms"]
        values = [("/dev/zero", 0, 8 * 720)]
        file.create_dataset("rr_ms", (1, 720), dtype="f8", external=values)


def named_twice(frame: pd.DataFrame) -> pd.DataFrame:
    return pd.concat([frame, frame["rr_ms"]], axis=1)


def other_protocol(phases: int) -> Break:
    return lambda cohort: recording(phases=phases).to_csv(cohort / "swe" / "S-1.csv", index=False)


def no_matter(path: Path) -> None:
    """Leave the place empty."""


SUBJECT_TABLE: Kinds = {
    "column missing": (
        subjects(",bsa_m2", ",BSA_m2"),
        "subjects.csv, row 1: lacks the columns bsa_m2; .*'BSA_m2' should be 'bsa_m2'",
    ),
    "column twice": (subjects("ivsd_cm", "ivsd_cm,sex"), "row 1: names a column twice: sex; rename"),
    "header only": (content("subjects.csv", HEADER.encode()), "subjects.csv: holds no data row; write"),
    "empty file": (content("subjects.csv", b""), r"subjects.csv: is empty|row 1: lacks the columns"),
    "subject twice": (subjects(FIRST, FIRST + "\n" + FIRST), "row 3, column 'subject': 'S-1' repeats"),
    "subject in two spellings": (
        subjects(FIRST, FIRST + "\n" + FIRST.lower().replace("f", "F", 1)),
        "row 3.*'s-1' differs .* in case, zeros",
    ),
    "row too short": (subjects(FIRST, FIRST[:-4]), "row 2: has 7 cells, the header has 8; .*complete"),
    "text in a number": (context("hr_bpm", "fast"), "row 2, column 'hr_bpm': 'fast' is not a number"),
    "NaN": (context("lvedv_ml", "NaN"), "row 2, column 'lvedv_ml': 'NaN' is not a number"),
    "empty cell": (context("bsa_m2", ""), "column 'bsa_m2': '' is not a number"),
    "negative": (context("bsa_m2", "-1.7"), "column 'bsa_m2': '-1.7' is outside .0.1, 4.; .*m2"),
    "septum in mm": (context("ivsd_cm", "8"), "column 'ivsd_cm': '8' is outside .0.2, 3.; .*in cm"),
    "volume in L": (context("lvedv_ml", "0.09"), "column 'lvedv_ml': '0.09' is outside .10, 500.; .*mL"),
    "volumes a tenth": (
        subjects("90,34", "14,5.4"),
        r"column 'lvedv_ml': '14' .*over bsa_m2 \(1.7\) is 8.24 mL/m2, expected",
    ),
    "end-systolic volume a tenth": (
        context("lvesv_ml", "3.4"),
        "column 'lvesv_ml': '3.4' .*ejection fraction of 0.96, expected 0.03 to 0.9",
    ),
    "volumes swapped": (subjects("90,34", "34,90"), "column 'lvesv_ml': '90' .*must be below .*swapped"),
    "volumes equal": (subjects("90,34", "90,90"), "column 'lvesv_ml': '90' .*must be below lvedv_ml"),
    "heart rate in Hz": (
        context("hr_bpm", "1"),
        "column 'hr_bpm': '1' is outside .30, 220.; .*beats per minute",
    ),
    "sex in words": (context("sex", "female"), "column 'sex': 'female' is refused: .*; write F or M"),
    "path out of the cohort": (context("subject", "../S-1"), r"'subject': '\.\./S-1' is refused.*letters"),
    "space in a name": (context("subject", "S 1"), "column 'subject': 'S 1' is refused.*letters, digits"),
    "no name": (context("subject", ""), "column 'subject': '' is refused.*letters, digits"),
    "name without end": (context("subject", "S" * 300), "column 'subject': 'S{60}...' is refused"),
    "Latin 1": (
        content("subjects.csv", (HEADER + ",größe\n").encode("latin-1")),
        r"cannot be read as UTF-8 text \(byte \d+\); save it as CSV in UTF-8",
    ),
    "a workbook": (content("subjects.csv", b"PK\x03\x04..."), "is an Excel workbook; save the sheet as 'CSV"),
    "no table": (
        lambda cohort: [(cohort / "subjects.csv").unlink(), (cohort / "swe" / "_notes.csv").touch()],
        r"cohort: 1 problem\n  - .*subjects.csv: no such file; put the",
    ),
    "link out of the cohort": (
        replaced(linked_out, "subjects.csv"),
        "subjects.csv: is reached by a link that leads out of the cohort",
    ),
}

SAMPLE_TABLE: Kinds = {
    "column missing": (
        table(lambda frame: frame.rename(columns={"rr_ms": "RR_ms"})),
        "lacks the columns rr_ms; .*'RR_ms' should",
    ),
    "column twice": (table(named_twice), "S-1.csv, row 1: names a column twice: rr_ms; rename"),
    "empty file": (content("swe/S-1.csv", b""), "S-1.csv: is empty|S-1.csv, row 1: lacks"),
    "header only": (table(lambda frame: frame[:0]), "S-1.csv: holds no data row; write at least one"),
    "text in a number": (cell(SPEED, "1.2 m/s"), f"row 6, column '{SPEED}': '1.2 m/s' is not a number"),
    "infinite": (cell(SPEED, "-inf"), "row 6, .*'-inf' is not a number"),
    "negative speed": (cell(SPEED, "-1.2"), "'-1.2' is outside .*; give it in m/s"),
    "speed in cm/s": (scaled(SPEED, 100.0), f"column '{SPEED}': .* is outside .0.05, 30.; give it in m/s"),
    "speed ten times": (
        table(lambda frame: frame.assign(**{SPEED: frame[SPEED].clip(upper=2.9) * 10.0})),
        f"column '{SPEED}': the median shear-wave speed is 1.* m/s, expected 0.5 to 10; check the unit",
    ),
    "speed a tenth": (scaled(SPEED, 0.1), "the median shear-wave speed is 0.1.* m/s, expected 0.5 to 10"),
    "speed and modulus": (
        table(lambda frame: frame.assign(youngs_modulus_kpa=5.0)),
        "has both of the columns|has shear_wave_speed_m_s and youngs_modulus_kpa; name the one",
    ),
    "neither of them": (
        table(lambda frame: frame.rename(columns={SPEED: "speed"})),
        f"has none of the columns {SPEED} and youngs",
    ),
    "modulus in Pa": (modulus(1000.0), "'youngs_modulus_kpa': .* is outside .0.0075, 2700.; give it in kPa"),
    "RR in s": (scaled("rr_ms", 1e-3), "column 'rr_ms': .* is outside .150, 5000.; give the RR interval in"),
    "delay in s": (
        scaled("trigger_delay_ms", 1e-3),
        "the longest trigger delay is 0.975 ms, and reaches 0.001",
    ),
    "delay a tenth": (
        scaled("trigger_delay_ms", 0.1),
        "the longest trigger delay is 97.5 ms, .*late diastole",
    ),
    "delay beyond the cycle": (
        table(lambda frame: frame.assign(trigger_delay_ms=frame["trigger_delay_ms"] * 1.5)),
        "phase_index 19 lies at 1.46 of its beat .*, after its end; check both columns",
    ),
    "another heart rate": (
        subjects("1.7,60", "1.7,95"),
        r"the median RR interval is 1000 ms \(60 .*\), but hr_bpm of S-1 .* is 95 \(632 ms\), limit",
    ),
    "R2 in percent": (scaled("fit_r2", 100.0), "column 'fit_r2': .* is outside .-1, 1.; R2 is a fraction"),
    "another status": (cell("status", "OK"), "row 6, column 'status': 'OK' is none of ok, no_wave, motion"),
    "row twice": (
        table(lambda frame: pd.concat([frame, frame[4:5]])),
        "row 722, column 'sample': '4' repeats the phase_index, repeat, sample of an earlier row; keep one",
    ),
    "too many phases missing": (
        failed(1, 4, 7, 10, 13),
        "25% of the phases are missing, limit 20% .15 of the 20",
    ),
    "too long a gap": (failed(8, 9, 10), "no phase was measured for 0.200 of the cycle after 0.375, limit"),
    "no late diastole": (failed(16, 17), "1 phases were measured in late diastole, .0.8, 0.97. .* needs 2"),
    "all attempts failed": (failed(*range(20)), "no sample is acceptable .no_wave .*; record again"),
    "fewer phases than configured": (
        other_protocol(12),
        "its 12 phases fill the cycle, but recording.phases in config.yaml is 20: .*if 12 were",
    ),
    "more phases than configured": (
        other_protocol(24),
        "'phase_index': '20' is outside .0, 19.; recording.phases in config.yaml is 20.*by --phases or",
    ),
    "phases counted from 1": (
        table(lambda frame: frame.assign(phase_index=frame["phase_index"] + 1)),
        "'20' .*number them from 0, or say `first_phase: 1`",
    ),
    "phases without rows, in no order": (
        table(lambda frame: frame[frame["phase_index"] != 5].replace({"phase_index": {3: 12, 12: 3}})),
        "phase_index 5 has no row, and the others do not follow the order of the cycle; add a row",
    ),
    "half a phase": (cell("phase_index", "1.5"), "row 6, column 'phase_index': '1.5' is not a whole number"),
    "two phases in one place": (
        table(lambda frame: frame.assign(trigger_delay_ms=frame["trigger_delay_ms"].replace(125.0, 75.0))),
        "two phase indices lie at the same phase 0.0750; check trigger_delay_ms",
    ),
    "decimal comma and point": (
        lambda cohort: (cohort / "swe" / "S-1.csv").write_text(
            recording().to_csv(index=False, sep=";").replace("0.95", "0,95", 1)
        ),
        "row 2, column 'fit_r2': '0,95' has a comma, while other numbers .*; use one decimal sign throughout",
    ),
    "decimal comma between commas": (cell(SPEED, '"1,5"'), "'1,5' is not a number; .*decimal point"),
    "comma in an open cell": (cell(SPEED, "1,5"), "S-1.csv, row 6: has 9 cells, the header has 8; .*commas"),
    "open quote": (
        cell(SPEED, '"1.5'),
        "S-1.csv, row 6: has a quote that opens a cell and does not close it in the same",
    ),
    "blank line": (
        lambda cohort: (cohort / "swe" / "S-1.csv").write_text(
            recording().to_csv(index=False).replace("ok", "ok\n", 1)
        ),
        "S-1.csv, row 3: has 0 cells, the header has 8; remove blank lines",
    ),
    "zero bytes": (
        content("swe/S-1.csv", b"phase_index\0,rr_ms\n"),
        "S-1.csv: holds zero bytes, so is no text",
    ),
    "Latin 1": (content("swe/S-1.csv", "größe\n".encode("latin-1")), "cannot be read as UTF-8 text"),
    "a workbook by its content": (content("swe/S-1.csv", b"\xd0\xcf\x11\xe0"), "is an Excel workbook; save"),
}

FILES: Kinds = {
    "no recording": (
        replaced(no_matter),
        r"swe: there is no file S-1.csv, S-1.tsv, .*S-1.xlsm; put it there, or take the subject out",
    ),
    "a workbook": (
        lambda cohort: (cohort / "swe" / "S-1.csv").rename(cohort / "swe" / "S-1.ods"),
        "S-1.ods: is a workbook; save the sheet as 'CSV UTF-8'",
    ),
    "two recordings": (
        lambda cohort: write_v5(cohort / "swe" / "S-1.mat", recording()),
        "S-1.csv: there is S-1.mat beside S-1.csv; keep the one that counts",
    ),
    "a folder": (replaced(Path.mkdir), "S-1.csv: is no regular file; put the file itself there"),
    "a pipe": (replaced(os.mkfifo), "S-1.csv: is no regular file; put the file itself there"),
    "link to nowhere": (replaced(lambda path: path.symlink_to("nowhere.csv")), "S-1.csv: no such file"),
    "link to itself": (replaced(lambda path: path.symlink_to(path.name)), "S-1.csv: no such file; put"),
    "link out of the cohort": (
        replaced(linked_out),
        "S-1.csv: is reached by a link that leads out of the cohort; copy the file",
    ),
    "folder linked out of the cohort": (
        replaced(linked_out, "swe"),
        "S-1.csv: is reached by a link that leads out of the cohort; copy",
    ),
    "no cohort": (
        lambda cohort: cohort.rename(cohort.with_name("gone")),
        "cohort: is no folder; correct|no such file",
    ),
}

MATLAB: Kinds = {
    "text as .mat": (
        matlab(lambda path: path.write_text("phase_index")),
        "S-1.mat: cannot be read as a .mat",
    ),
    "truncated, version 7.3": (matlab(truncated(write_v73, 0.7)), "S-1.mat: cannot be read as a .mat file"),
    "variable missing": (
        matlab(lambda path: write_v5(path, recording().drop(columns="rr_ms"))),
        "S-1.mat: lacks the columns rr_ms; it has .*; save vectors of these names, or one struct",
    ),
    "matrix": (
        matlab(lambda path: savemat(path, columns(recording()) | {"rr_ms": np.ones((20, 36))})),
        "S-1.mat, column 'rr_ms': is an array of 20 x 36; save one value per attempted sample",
    ),
    "lengths differ": (
        matlab(lambda path: savemat(path, columns(recording()) | {"rr_ms": np.ones(9)})),
        r"its vectors differ in length \(.*rr_ms 9.*; give every attempted sample an element in each",
    ),
    "empty vectors": (matlab(lambda path: write_v5(path, recording()[:0])), "its vectors are empty; save"),
    "complex numbers": (
        matlab(lambda path: savemat(path, columns(recording()) | {SPEED: np.ones(720) * 1j})),
        f"column '{SPEED}': is complex; save it as a real vector",
    ),
    "a cell of a number": (
        matlab(
            lambda path: savemat(path, columns(recording()) | {"status": np.array([1.0, "ok"], dtype=object)})
        ),
        "column 'status': has a cell that is no text; save texts as a cell array",
    ),
    "two structs": (
        matlab(lambda path: savemat(path, {"a": columns(recording()), "b": columns(recording(1))})),
        r"S-1.mat: holds several recordings \(a, b\); save one struct a file",
    ),
    "values in another file": (matlab(external), "'rr_ms': keeps its values in another file; save it again"),
    "a value out of range": (
        matlab(lambda path: write_v5(path, recording().assign(rr_ms=1.0))),
        "S-1.mat, element 1, column 'rr_ms': '1' is outside .150, 5000.; give the RR interval in ms",
    ),
}

PROTOCOLS: Kinds = {
    "no protocol": (lambda cohort: (cohort / "recording.yaml").unlink(), "recording.yaml: no such file; put"),
    "no origin": (content("recording.yaml", b"origin:\n"), "has no text under the key `origin`; say"),
    "no YAML": (content("recording.yaml", b"a: [1\n"), "recording.yaml: cannot be read as YAML"),
    "a date": (content("recording.yaml", b"a: 2001-99-99\n"), "has the key `a`, which is not known"),
    "origin that clears the screen": (
        content("recording.yaml", b'origin: "a\\e[2J"\n'),
        r"under the key `origin` has a sign that cannot be seen; type",
    ),
    "protocol of one word": (
        content("recording.yaml", b"origin: a\nprotocol: x\n"),
        "under the key `protocol`: Input should be",
    ),
    "another density": (
        content("recording.yaml", b"origin: a\ndensity_kg_m3: 1060\n"),
        "density_kg_m3 is 1060, but recording.density_kg_m3 in config.yaml is 1000; correct the one",
    ),
    "another number of phases": (
        content("recording.yaml", b"origin: a\nprotocol: {phases: 12}\n"),
        "protocol.phases is 12, but recording.phases in config.yaml is 20; correct the one that is wrong",
    ),
}

KINDS = in_parts(subjects=SUBJECT_TABLE, samples=SAMPLE_TABLE, files=FILES, matlab=MATLAB, protocol=PROTOCOLS)
