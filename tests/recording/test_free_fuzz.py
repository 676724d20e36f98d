"""Whatever a free-running file holds, it gives valid pushes or is refused in words; never a traceback."""

from __future__ import annotations

import io
from pathlib import Path

import free_case
import numpy as np
import pytest
import yaml
from free_case import HEART, QUALITY
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat
from test_fuzz import KNOBS, NUMBERS, SIGNS, STATUSES

from swesbi.recording.check import examine_cohort
from swesbi.recording.columns import EVENT, FREE_COLUMNS, MODULUS
from swesbi.recording.foreign import is_free
from swesbi.recording.free_noise import SOURCES
from swesbi.recording.free_observation import ingest_free
from swesbi.recording.free_samples import read_free_samples
from swesbi.recording.layout import layout_of
from swesbi.recording.problems import RecordingError
from swesbi.recording.settings import NoiseDeclaration

DECLARED = st.sampled_from(
    [
        NoiseDeclaration(),
        NoiseDeclaration(fit_points=3),
        NoiseDeclaration(cv_fraction=0.5, cv_log_sd=1.5),
    ]
)
CELLS = st.one_of(NUMBERS, st.sampled_from(["0.5", "1", "2.5", "300", "980", "1000", "1050"]))
TEXTS = {"status": STATUSES, EVENT: st.sampled_from(["mvc", "push", ""])}
NAMES = st.lists(st.sampled_from([*FREE_COLUMNS, MODULUS, EVENT, "phase_index", "x"]), max_size=9)


def answered(path: Path, declared: NoiseDeclaration, said: dict[str, object] | None = None) -> bool:
    """Read a recording, as this says its table is; tell whether it can be inferred."""
    try:
        layout = layout_of(said or {}, path)
        is_free(path, layout)
        samples = read_free_samples(path, 1000.0, layout, "T")
        seen = ingest_free(samples, HEART, QUALITY, declared)
    except RecordingError as error:
        assert error.problems
        assert str(path) in str(error)
        return False
    assert len(seen.phase) >= 2
    assert ((seen.phase >= 0.0) & (seen.phase < 1.0)).all()
    assert (np.diff(seen.phase) >= 0.0).all()
    assert (np.diff(seen.cell) >= 0).all()
    assert ((seen.cell >= 0) & (seen.cell < 20)).all()
    assert (np.isfinite(seen.relative_se) & (seen.relative_se > 0.0)).all()
    assert np.isfinite(seen.stiffness_kpa).all()
    assert seen.noise_source in SOURCES
    return True


@given(data=st.data(), sign=SIGNS, declared=DECLARED)
@settings(max_examples=200, **KNOBS)
def test_any_table_is_read_or_refused(
    tmp_path: Path, data: st.DataObject, sign: str, declared: NoiseDeclaration
) -> None:
    names = data.draw(NAMES)
    row = [TEXTS.get(name, CELLS) for name in names]
    rows = data.draw(st.lists(st.tuples(*row), max_size=5))
    path = tmp_path / "T.csv"
    path.write_text("\n".join(sign.join(cells) for cells in (names, *rows)), encoding="utf-8")
    answered(path, declared)


@given(
    rows=st.lists(
        st.tuples(
            st.floats(0.0, 1200.0), st.floats(850.0, 1150.0), st.floats(0.3, 8.0), st.floats(1e-6, 1.0)
        ),
        min_size=1,
        max_size=12,
    )
)
@settings(max_examples=100, **KNOBS)
def test_plausible_pushes_are_read_or_refused(
    tmp_path: Path, rows: list[tuple[float, float, float, float]]
) -> None:
    path = tmp_path / "T.csv"
    lines = [",".join(map(repr, row)) for row in rows]
    path.write_text("\n".join(["time_ms,rr_ms,shear_wave_speed_m_s,se_m_s", *lines]), encoding="utf-8")
    answered(path, NoiseDeclaration())


@pytest.mark.parametrize("cut", [1, 20, 59, 70, 76, 90, 93])
def test_a_file_that_was_cut_off_is_read_or_refused(tmp_path: Path, cut: int) -> None:
    text = "time_ms,rr_ms,shear_wave_speed_m_s,se_m_s\n100,1000,2.0,0.2\n300,1000,3.0,0.3\n700,1000,1.5,0.1\n"
    path = tmp_path / "T.csv"
    path.write_text(text[:cut], encoding="utf-8")
    assert answered(path, NoiseDeclaration()) is (cut in (76, 93))  # after whole rows, two at least


KEYS = st.sampled_from(
    [*FREE_COLUMNS, MODULUS, "columns", "units", "table", "noise", "protocol", "values", "file", "x"]
)
LEAVES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-2, 40),
    st.floats(),
    KEYS,
    st.sampled_from(["s", "cm/s", "c *", ""]),
)
YAML = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=4),
    max_leaves=12,
)
OVERRIDES = st.dictionaries(
    st.sampled_from(["protocol", "columns", "units", "table", "noise", "origin"]), YAML, max_size=4
)


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return free_case.mixed(tmp_path_factory.mktemp("fuzzed") / "cohort")


@given(said=OVERRIDES, subject=st.sampled_from(["S-1", "s_2x", "S-3"]))
@settings(max_examples=60, **KNOBS)
def test_whatever_a_recording_says_of_itself_the_others_stay(
    mixed: Path, said: dict[str, object], subject: str
) -> None:
    path = mixed / "swe" / f"{subject}.yaml"
    before = path.read_text() if path.exists() else None
    path.write_text(yaml.safe_dump(said))
    try:
        report = examine_cohort(mixed, QUALITY, 100)
    finally:
        path.unlink() if before is None else path.write_text(before)
    assert {"S-1", "s_2x", "S-3"} - {subject} <= set(report.usable)
    assert all(subject in str(problem) for problem in report.problems)


@given(said=OVERRIDES)
@settings(max_examples=100, **KNOBS)
def test_whatever_is_said_of_a_table_it_is_read_or_refused(tmp_path: Path, said: dict[str, object]) -> None:
    path = tmp_path / "T.csv"
    free_case.train(2).rename(columns={"rr_ms": "x"}).to_csv(path, index=False)
    answered(path, NoiseDeclaration(cv_fraction=0.1, cv_log_sd=0.3), said)


@given(data=st.data(), suffix=st.sampled_from([".xlsx", ".mat"]))
@settings(max_examples=60, **KNOBS)
def test_a_damaged_workbook_or_mat_file_is_read_or_refused(
    tmp_path: Path, data: st.DataObject, suffix: str
) -> None:
    raw = bytearray(BOOK if suffix == ".xlsx" else VECTORS)
    for _ in range(data.draw(st.integers(0, 4))):
        raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path / f"T{suffix}"
    path.write_bytes(
        bytes(raw[: data.draw(st.integers(0, len(raw)))]) if data.draw(st.booleans()) else bytes(raw)
    )
    answered(path, NoiseDeclaration(cv_fraction=0.1, cv_log_sd=0.3))


def _written(suffix: str) -> bytes:
    train, buffer = free_case.train(2), io.BytesIO()
    if suffix == ".xlsx":
        train.to_excel(buffer, index=False)
    else:
        numbers = train.select_dtypes("number")
        savemat(buffer, {name: numbers[name].to_numpy() for name in numbers})
    return buffer.getvalue()


BOOK, VECTORS = _written(".xlsx"), _written(".mat")
