from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from recordings import DENSITY, PHASES, make_samples

from data.makers.files import samples_table
from swesbi.recording.cohort import read_subject_table, read_subjects
from swesbi.recording.problems import RecordingError
from swesbi.recording.reader import read_samples

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
        ((HEADER.replace(",", "|"), ROW.replace(",", "|")), "separated by commas"),
        (
            (HEADER, ROW, ROW.replace("A,", "B,").replace("57", "fast")),
            "row 3, column 'hr_bpm': 'fast' is not",
        ),
        ((HEADER, ROW + ",9"), "row 2: has 9 cells, the header has 8"),
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
