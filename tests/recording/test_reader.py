from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from recordings import DENSITY, PHASES, make_samples

from swesbi.recording.cohort import read_subject_table, read_subjects
from swesbi.recording.problems import RecordingError
from swesbi.recording.reader import read_samples
from swesbi.virtual.files import samples_table

HEADER = "subject,sex,age_years,bsa_m2,hr_bpm,lvedv_ml,lvesv_ml,ivsd_cm"
ROW = "A,M,24,1.88,57,118,45,0.88"


def write(path: Path, *lines: str) -> Path:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_subjects_are_read_in_order_and_other_columns_ignored(tmp_path: Path) -> None:
    path = write(tmp_path / "subjects.csv", HEADER + ",note", ROW + ",x", "B,F,27,1.68,64,84,31,0.74,")
    subjects = read_subjects(path)
    assert [subject.subject for subject in subjects] == ["A", "B"]
    assert subjects[0].lvedv_ml == 118.0
    assert subjects[1].sex == "F"
    assert read_subject_table(path).rows["A"].to_context() == subjects[0]


def test_byte_order_mark_spaces_and_trailing_blank_lines_do_no_harm(tmp_path: Path) -> None:
    path = tmp_path / "subjects.csv"
    path.write_text("\ufeff" + HEADER.replace(",", ", ") + "\n" + ROW + " \n\n\n", encoding="utf-8")
    assert read_subjects(path)[0].ivsd_cm == 0.88


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ((HEADER.replace(",ivsd_cm", ""), "A,M,24,1.88,57,118,45"), "row 1: lacks the columns ivsd_cm"),
        ((HEADER.replace(",", "|"), ROW.replace(",", "|")), "separated by commas"),
        ((HEADER, ROW.replace(",M,", ",male,")), "row 2, column 'sex': 'male'"),
        (
            (HEADER, ROW, ROW.replace("A,", "B,").replace("57", "fast")),
            "row 3, column 'hr_bpm': 'fast' is not",
        ),
        ((HEADER, ROW.replace("57", "")), "row 2, column 'hr_bpm': '' is not a number"),
        ((HEADER, ROW.replace("0.88", "8.8")), "row 2, column 'ivsd_cm': '8.8' is outside .0.2, 3.; .*units"),
        ((HEADER, ROW.replace("118,45", "45,118")), "row 2, column 'lvesv_ml': '118'.*swapped"),
        ((HEADER, ROW, ROW), "row 3, column 'subject': 'A' repeats"),
        ((HEADER, ROW.replace("A,", "a/b,")), "column 'subject': 'a/b'"),
        ((HEADER, ROW + ",9"), "row 2: has 9 cells, the header has 8"),
        ((HEADER,), "holds no data row"),
        ((HEADER.replace("sex", "subject"), ROW), "lacks the columns sex"),
    ],
)
def test_bad_subject_tables_are_refused_with_place_and_value(
    tmp_path: Path, lines: tuple[str, ...], message: str
) -> None:
    path = write(tmp_path / "subjects.csv", *lines)
    with pytest.raises(RecordingError, match=message) as caught:
        read_subjects(path)
    assert str(path) in str(caught.value)


def test_samples_survive_the_round_trip(tmp_path: Path) -> None:
    samples = make_samples(sample_sd=0.1)
    samples.speed_m_s[3] = np.nan
    samples.status[3] = "motion"
    samples_table(samples).to_csv(tmp_path / "A.csv", index=False)
    read = read_samples(tmp_path / "A.csv", PHASES, DENSITY)
    for name in ("phase_index", "trigger_delay_ms", "rr_ms", "repeat", "sample", "speed_m_s", "status"):
        np.testing.assert_array_equal(getattr(read, name), getattr(samples, name))
    assert read.source.endswith("A.csv")


@pytest.mark.parametrize(
    ("column", "value", "message"),
    [
        ("shear_wave_speed_m_s", "1,5", "row 5: has 9 cells, the header has 8"),
        ("shear_wave_speed_m_s", "fast", "row 5, column 'shear_wave_speed_m_s': 'fast' is not a number"),
        ("shear_wave_speed_m_s", "-1.2", "'-1.2' is outside .*m/s"),
        ("shear_wave_speed_m_s", "1200", "'1200' is outside"),
        ("shear_wave_speed_m_s", "inf", "'inf' is not a number"),
        ("rr_ms", "0.95", "column 'rr_ms': '0.95' is outside .*in ms"),
        ("rr_ms", "", "column 'rr_ms': '' is not a number"),
        ("trigger_delay_ms", "-3", "column 'trigger_delay_ms': '-3' is outside"),
        ("fit_r2", "95", "column 'fit_r2': '95' is outside"),
        ("status", "OK", "column 'status': 'OK' is none of ok, no_wave, motion, low_r2, bound_hit"),
        ("phase_index", "20", "column 'phase_index': '20' is outside .*expects 20 phases"),
        ("phase_index", "1.5", "'1.5' is not a whole number"),
        ("sample", "2", "row 5, column 'sample': '2' repeats the phase_index, repeat, sample"),
    ],
)
def test_bad_samples_are_refused_with_place_and_value(
    tmp_path: Path, column: str, value: str, message: str
) -> None:
    path = tmp_path / "A.csv"
    table = samples_table(make_samples()).astype(str)
    table.loc[3, column] = value
    lines = [",".join(table.columns), *(",".join(row) for row in table.itertuples(index=False))]
    write(path, *lines)
    with pytest.raises(RecordingError, match=message) as caught:
        read_samples(path, PHASES, DENSITY)
    assert str(path) in str(caught.value)


def test_a_missing_or_unreadable_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="nowhere.csv: no such file"):
        read_samples(tmp_path / "nowhere.csv", PHASES, DENSITY)
    (tmp_path / "latin.csv").write_bytes("größe,ß\n1,2\n".encode("latin-1"))
    with pytest.raises(RecordingError, match="latin.csv: cannot be read as UTF-8"):
        read_samples(tmp_path / "latin.csv", PHASES, DENSITY)
