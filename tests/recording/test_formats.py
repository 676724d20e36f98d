"""A recording is the same whatever file it comes in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from cohorts import columns, recording, write_cohort, write_overlay, write_v5, write_v73
from recordings import CONTEXT, DENSITY, PHASES, RECORDING, make_samples
from scipy.io import savemat

from data.makers.files import samples_table
from swesbi.__main__ import main
from swesbi.artefacts import load
from swesbi.recording.cohort import read_subjects
from swesbi.recording.ingest import ingest
from swesbi.recording.problems import RecordingError
from swesbi.recording.reader import read_samples
from swesbi.recording.samples import Samples

FIELDS = ("phase_index", "trigger_delay_ms", "rr_ms", "repeat", "sample", "speed_m_s", "fit_r2", "status")
Writer = Callable[[Path, pd.DataFrame], None]


def text(path: Path, table: pd.DataFrame, encoding: str = "utf-8", **options: str) -> None:
    path.write_text(table.to_csv(index=False, **options), encoding=encoding)


def commented(path: Path, table: pd.DataFrame) -> None:
    lines = table.to_csv(index=False).splitlines()
    path.write_text(
        "\n".join(["# scanner 2", "#", *lines[:5], "# one more, with a , in it", *lines[5:], "", ""])
    )


def char_matrix(path: Path, table: pd.DataFrame) -> None:
    savemat(path, columns(table) | {"status": np.array(list(table["status"])), "other": "kept out"})


def row_vectors(path: Path, table: pd.DataFrame) -> None:
    savemat(path, {name: value.T for name, value in columns(table).items()})


WRITERS: dict[str, tuple[str, Writer]] = {
    "semicolon": (".csv", lambda path, table: text(path, table, sep=";")),
    "semicolon, decimal comma": (".csv", lambda path, table: text(path, table, sep=";", decimal=",")),
    "tab, decimal comma": (".csv", lambda path, table: text(path, table, sep="\t", decimal=",")),
    "byte order mark": (".csv", lambda path, table: text(path, table, "utf-8-sig", sep=";", decimal=",")),
    "Windows line ends": (".csv", lambda path, table: text(path, table, lineterminator="\r\n")),
    "NaN for empty": (".csv", lambda path, table: text(path, table, na_rep="NaN")),
    "comments": (".csv", commented),
    "columns in another order, and more": (
        ".csv",
        lambda path, table: text(path, table.iloc[:, ::-1].assign(operator="x;y")),
    ),
    "MATLAB 5, vectors": (".mat", write_v5),
    "MATLAB 5, row vectors": (".mat", row_vectors),
    "MATLAB 5, struct": (".mat", lambda path, table: write_v5(path, table, "rec")),
    "MATLAB 5, char matrix": (".mat", char_matrix),
    "MATLAB 7.3, vectors": (".mat", write_v73),
    "MATLAB 7.3, struct": (".mat", lambda path, table: write_v73(path, table, "rec")),
}


def assert_same(left: Samples, right: Samples) -> None:
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(left, name), getattr(right, name), err_msg=name)


@pytest.mark.parametrize("form", WRITERS)
def test_every_format_gives_the_samples_of_its_twin_in_csv(tmp_path: Path, form: str) -> None:
    table = recording()
    suffix, write = WRITERS[form]
    table.to_csv(tmp_path / "twin.csv", index=False)
    write(tmp_path / f"S{suffix}", table)
    read = read_samples(tmp_path / f"S{suffix}", PHASES, DENSITY)
    assert_same(read, read_samples(tmp_path / "twin.csv", PHASES, DENSITY))
    assert np.isnan(read.speed_m_s).any()


def test_numbers_survive_the_way_through_matlab_to_the_last_bit(tmp_path: Path) -> None:
    table = samples_table(make_samples(repeat_sd=0.03, sample_sd=0.1))
    for name, write in (("5", write_v5), ("73", write_v73)):
        write(tmp_path / f"{name}.mat", table)
        read = read_samples(tmp_path / f"{name}.mat", PHASES, DENSITY)
        np.testing.assert_array_equal(read.speed_m_s, table["shear_wave_speed_m_s"])


@pytest.mark.parametrize("write", [write_v5, write_v73])
def test_a_matlab_cohort_gives_the_observed_curves_of_its_twin_in_csv(tmp_path: Path, write: Writer) -> None:
    cohorts = [write_cohort(tmp_path / name) for name in ("csv", "mat")]
    for path in sorted((cohorts[1] / "swe").iterdir()):
        write(path.with_suffix(".mat"), pd.read_csv(path, keep_default_na=True))
        path.unlink()
    for cohort, suffix in zip(cohorts, ("csv", "mat"), strict=True):
        changes = write_overlay(tmp_path / f"{suffix}.yaml", cohort)
        files = [
            "--recording",
            str(cohort / "swe" / f"S-1.{suffix}"),
            "--observation",
            str(cohort / "S-1.h5"),
        ]
        assert main(["stages", "ingest", *files, "--subject", "S-1", "--overlay", str(changes)]) == 0
    for group in ("/", "context"):
        twins = [load(cohort / "S-1.h5", "observation", group)[0] for cohort in cohorts]
        assert twins[0].identical(twins[1])


@pytest.mark.parametrize("density", [1000.0, 1060.0])
def test_a_modulus_becomes_a_speed_sample_by_sample(tmp_path: Path, density: float) -> None:
    table = recording()
    speed = table.pop("shear_wave_speed_m_s")
    table["youngs_modulus_kpa"] = 3.0 * density * speed**2 / 1e3
    table.to_csv(tmp_path / "S.csv", index=False)
    read = read_samples(tmp_path / "S.csv", PHASES, density)
    np.testing.assert_allclose(read.speed_m_s, speed, rtol=1e-14)
    observed = ingest(read, CONTEXT, RECORDING.model_copy(update={"density_kg_m3": density}), 100)
    direct = ingest(
        replace(read, speed_m_s=speed.to_numpy()),
        CONTEXT,
        RECORDING.model_copy(update={"density_kg_m3": density}),
        100,
    )
    np.testing.assert_allclose(observed.curve_kpa, direct.curve_kpa, rtol=1e-12)


@pytest.mark.parametrize("phases", [8, 11, 20, 37, 60])
def test_recordings_of_other_numbers_of_phases_in_any_order(tmp_path: Path, phases: int) -> None:
    table = recording(phases=phases)
    order = np.random.default_rng(1).permutation(phases)
    shuffled = table.assign(phase_index=order[table["phase_index"]]).sample(frac=1.0, random_state=2)
    settings = RECORDING.model_copy(update={"phases": phases})
    curves = []
    for name, form in (("plain", table), ("shuffled", shuffled)):
        form.to_csv(tmp_path / f"{name}.csv", index=False)
        read = read_samples(tmp_path / f"{name}.csv", phases, DENSITY)
        curves.append(ingest(read, CONTEXT, settings, 100).curve_kpa)
    np.testing.assert_allclose(curves[1], curves[0], rtol=1e-12)


def test_a_link_within_the_cohort_is_followed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cohort = write_cohort(tmp_path / "cohort")
    (cohort / "swe" / "S-1.csv").rename(cohort / "raw.csv")
    (cohort / "swe" / "S-1.csv").symlink_to(cohort / "raw.csv")
    assert main(["validate", str(cohort)]) == 0
    assert "2 recordings can be used" in capsys.readouterr().out


def test_a_table_of_subjects_from_a_spreadsheet(tmp_path: Path) -> None:
    path = tmp_path / "subjects.csv"
    header = "subject;sex;age_years;bsa_m2;hr_bpm;lvedv_ml;lvesv_ml;ivsd_cm;"
    path.write_bytes(f"{header}\r\n001;F;25;1,7;60;90;34;0,8;\r\n;;;;;;;;\r\n".encode("utf-8-sig"))
    (subject,) = read_subjects(path)
    assert (subject.subject, subject.bsa_m2, subject.ivsd_cm) == ("001", 1.7, 0.8)


def test_a_matlab_cell_that_is_empty_is_an_empty_text(tmp_path: Path) -> None:
    table = recording()
    status = columns(table)["status"]
    status[3, 0] = ""
    savemat(tmp_path / "S.mat", columns(table) | {"status": status})
    with pytest.raises(RecordingError, match="element 4, column 'status': '' is none of ok"):
        read_samples(tmp_path / "S.mat", PHASES, DENSITY)


def test_a_link_in_a_matlab_file_is_not_followed(tmp_path: Path) -> None:
    write_v73(tmp_path / "elsewhere.mat", recording())
    write_v73(tmp_path / "S.mat", recording())
    with h5py.File(tmp_path / "S.mat", "a") as file:
        del file["rr_ms"]
        file["rr_ms"] = h5py.ExternalLink(str(tmp_path / "elsewhere.mat"), "rr_ms")
    with pytest.raises(RecordingError, match="column 'rr_ms': is a link, not a variable"):
        read_samples(tmp_path / "S.mat", PHASES, DENSITY)


@pytest.mark.slow
def test_a_million_rows_are_read(tmp_path: Path) -> None:
    samples = make_samples(sample_sd=0.05, per_repeat=16_667)
    samples_table(samples).to_csv(tmp_path / "S.csv", index=False)
    read = read_samples(tmp_path / "S.csv", PHASES, DENSITY)
    assert len(read.status) > 1_000_000
    np.testing.assert_array_equal(read.speed_m_s, samples.speed_m_s)
