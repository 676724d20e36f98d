"""Whatever a file holds, it is read as valid or refused: tables, workbooks, MATLAB, subjects, YAML."""

from __future__ import annotations

import functools
import io
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import free_case
import kinds
import numpy as np
import pandas as pd
import pytest
import yaml
from cohorts import HEADER, PROTOCOL, ROWS, columns, recording, write_v73
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from recordings import CONTEXT, DENSITY, RECORDING
from scipy.io import savemat

from swesbi.recording.cohort.check import examine_cohort
from swesbi.recording.cohort.recording_file import description_of, layout_of
from swesbi.recording.cohort.subjects import read_subject_table, read_subjects
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import SOURCES, Observation
from swesbi.recording.problems import RecordingError
from swesbi.recording.pushes import ingest_pushes
from swesbi.recording.reader import samples_in
from swesbi.recording.samples import Samples
from swesbi.recording.settings import NoiseDeclaration
from swesbi.recording.tables.columns import COLUMNS, EVENT, FAILED_STATUSES, FREE_COLUMNS, MODULUS
from swesbi.recording.tables.files import open_table
from swesbi.recording.tables.layout import OWN_FORM, TableLayout

PHASES = 8
FAST, SLOW, EXHAUSTIVE = 300, 2_000, 10_000
GATED = [*COLUMNS, MODULUS]
FREE = [*FREE_COLUMNS, MODULUS, EVENT]
ODD = [
    "",
    "NaN",
    "inf",
    "1,5",
    "1.5",
    "1e999",
    "0x1",
    "1_0",
    "٣",
    "+.5",
    "--1",
    "9" * 400,
    "1\u202f0",
    '"1',
    "1%",
]
NUMBERS = st.one_of(
    st.floats().map(repr), st.integers(-3, 40).map(str), st.sampled_from(ODD), st.text(max_size=6)
)
LIKELY = st.sampled_from(["0.5", "1", "2.5", "300", "980", "1000", "1050"])
STATUSES = st.one_of(st.sampled_from(["ok", *FAILED_STATUSES]), st.text(max_size=4))
DECLARED = st.sampled_from(
    [NoiseDeclaration(), NoiseDeclaration(fit_points=3), NoiseDeclaration(cv_fraction=0.5, cv_log_sd=1.5)]
)
KNOBS: dict[str, Any] = {
    "derandomize": True,
    "database": None,
    "deadline": None,
    "suppress_health_check": [HealthCheck.function_scoped_fixture],
}


def valid(samples: Samples) -> None:
    """What every recording that was read must fulfil."""
    delay = samples.time_ms
    assert delay.ndim == 1 and len(delay) > 0
    assert ((samples.rr_ms >= 150) & (samples.rr_ms <= 5000)).all()
    assert ((delay >= 0) & (delay <= 5000)).all()
    assert (np.isnan(samples.speed_m_s) | ((samples.speed_m_s > 0.0499) & (samples.speed_m_s < 30.001))).all()
    assert samples.fit_r2 is None or (np.isnan(samples.fit_r2) | (np.abs(samples.fit_r2) <= 1)).all()
    assert np.isin(samples.status, ["ok", *FAILED_STATUSES]).all()
    if samples.is_gated:
        assert ((samples.phase_index >= 0) & (samples.phase_index < PHASES)).all()
        triples = np.stack([samples.phase_index, samples.repeat, samples.sample])
        assert len(np.unique(triples, axis=1).T) == len(delay)


def valid_pushes(seen: Observation) -> None:
    assert seen.measured.sum() >= 2
    assert ((seen.phase >= 0.0) & (seen.phase < 1.0) & (np.diff(seen.phase, prepend=0.0) >= 0.0)).all()
    assert ((seen.cell >= 0) & (seen.cell < 20) & (np.diff(seen.cell, prepend=0) >= 0)).all()
    assert (np.isfinite(seen.relative_se) & (seen.relative_se > 0.0)).all()
    assert np.isfinite(seen.stiffness_kpa[seen.measured]).all()
    assert seen.errors_from in SOURCES


def read(path: Path, layout: TableLayout = OWN_FORM, declared: NoiseDeclaration = free_case.DECLARED) -> bool:
    """Read a recording, whatever it is; tell whether it can be inferred."""
    try:
        samples = samples_in(open_table(path, layout), PHASES, DENSITY, layout, "S")
        valid(samples)
        if not samples.is_gated:
            valid_pushes(ingest_pushes(samples, free_case.HEART, free_case.QUALITY, declared))
        else:
            observed = ingest(samples, CONTEXT, RECORDING.model_copy(update={"phases": PHASES}), 20)
            assert np.isfinite(observed.curve_kpa).all()
    except RecordingError as error:
        assert error.problems
        assert str(path) in str(error)
        return False
    return True


@functools.cache
def good_table() -> pd.DataFrame:
    return recording(phases=PHASES)


@functools.cache
def good_bytes(form: str) -> bytes:
    """A good recording, gated or free-running, as a file of each format, held in memory."""
    buffer = io.BytesIO()
    if form == "csv":
        return good_table().to_csv(index=False).encode()
    if form == "free csv":
        return free_case.train(2).to_csv(index=False).encode()
    if form == "mat":
        savemat(buffer, columns(good_table()))
    elif form == "xlsx":
        good_table()[:60].to_excel(buffer, index=False)
    return buffer.getvalue()


@st.composite
def csv_texts(draw: st.DrawFn) -> str:
    """Tables of roughly the right shape: columns dropped, doubled or shuffled, cells of all kinds."""
    sign, own = draw(st.sampled_from([",", ";", "\t"])), draw(st.sampled_from([GATED, FREE]))
    names = draw(st.permutations(own))[: draw(st.sampled_from([9, 9, 8, 8, 7, 3]))]
    names += draw(st.lists(st.sampled_from([*own, "other", ""]), max_size=1))
    cells = st.one_of(NUMBERS, LIKELY)
    rows = draw(st.lists(st.tuples(*(STATUSES if name == "status" else cells for name in names)), max_size=5))
    lines = [sign.join(names), *(sign.join(row) for row in rows)]
    lines += draw(st.lists(st.one_of(st.just(""), st.just("# x"), st.text(max_size=8)), max_size=1))
    ends = draw(st.sampled_from(["\n", "\r\n", "\r"]))
    return draw(st.sampled_from(["", "\ufeff", "\n"])) + ends.join(lines)


@st.composite
def edited(draw: st.DrawFn, raw: bytes) -> bytes:
    """A good file with a few bytes changed, cut out or put in, or cut off."""
    content = bytearray(raw)
    for _ in range(draw(st.integers(1, 3))):
        start = draw(st.integers(0, max(len(content) - 1, 0)))
        stop = start + draw(st.sampled_from([0, 0, 1, 1, 1, 2, 5, 30, len(content)]))
        content[start:stop] = draw(st.binary(max_size=4))
    return bytes(content)


@st.composite
def near_tables(draw: st.DrawFn) -> pd.DataFrame:
    """A good recording with some values replaced by others that their columns allow."""
    table = good_table().astype({"trigger_delay_ms": float, "rr_ms": float})
    changes = {
        "phase_index": st.integers(0, PHASES - 1),
        "trigger_delay_ms": st.floats(0, 5000),
        "rr_ms": st.floats(150, 5000),
        "shear_wave_speed_m_s": st.one_of(st.just(np.nan), st.floats(0.05, 30)),
        "status": st.sampled_from(["ok", "motion"]),
    }
    for _ in range(draw(st.integers(0, 4))):
        name = draw(st.sampled_from(list(changes)))
        start = draw(st.integers(0, len(table) - 1))
        stop = start + draw(st.sampled_from([1, 12, 36, 108, 288]))
        table.loc[start:stop, name] = draw(changes[name])
    kept = draw(st.sampled_from([1.0, 1.0, 0.9, 0.3, 0.01]))
    return table.sample(frac=kept, random_state=draw(st.integers(0, 9)))


def any_csv(folder: Path, examples: int) -> None:
    @settings(max_examples=examples, **KNOBS)
    @given(csv_texts(), DECLARED)
    def check(text: str, declared: NoiseDeclaration) -> None:
        path = folder / "S.csv"
        path.write_text(text, encoding="utf-8", errors="surrogatepass", newline="")
        read(path, declared=declared)

    check()


def any_bytes(folder: Path, examples: int) -> None:
    @settings(max_examples=examples, **KNOBS)
    @given(st.binary(max_size=60), st.sampled_from([".csv", ".mat", ".xlsx"]))
    def check(raw: bytes, suffix: str) -> None:
        path = folder / f"S{suffix}"
        path.write_bytes(raw)
        assert not read(path)

    check()


def damaged(form: str, folder: Path, examples: int) -> None:
    path = folder / f"S.{form.split()[-1]}"
    raw = good_bytes(form)
    if form == "v73 mat":
        write_v73(folder / "good.mat", good_table()[:40])
        raw = (folder / "good.mat").read_bytes()

    @settings(max_examples=examples, **KNOBS)
    @given(edited(raw))
    def check(content: bytes) -> None:
        path.unlink(missing_ok=True)
        path.write_bytes(content)
        read(path)

    check()


def allowed_values(folder: Path, examples: int) -> None:
    seen = []

    @settings(max_examples=examples, **KNOBS)
    @given(near_tables())
    def check(table: pd.DataFrame) -> None:
        table.to_csv(folder / "S.csv", index=False)
        seen.append(read(folder / "S.csv"))

    check()
    assert any(seen)


def allowed_pushes(folder: Path, examples: int) -> None:
    times, rr_ms, speeds = st.floats(0.0, 1200.0), st.floats(850.0, 1150.0), st.floats(0.3, 8.0)
    rows = st.lists(st.tuples(times, rr_ms, speeds, st.floats(1e-6, 1.0)), min_size=1, max_size=12)
    seen = []

    @settings(max_examples=examples, **KNOBS)
    @given(rows)
    def check(pushes: list[tuple[float, float, float, float]]) -> None:
        lines = [",".join(map(repr, row)) for row in pushes]
        text = "\n".join(["time_ms,rr_ms,shear_wave_speed_m_s,se_m_s", *lines])
        (folder / "S.csv").write_text(text, encoding="utf-8")
        seen.append(read(folder / "S.csv", declared=NoiseDeclaration()))

    check()
    assert any(seen)


def matlab_values(folder: Path, examples: int) -> None:
    values = st.one_of(
        st.floats().map(lambda value: np.full((1, 3), value)),
        st.lists(st.integers(-2, 9), min_size=3, max_size=3).map(
            lambda items: np.array(items, dtype=np.int16)
        ),
        st.just(np.zeros((0, 0))),
        st.just(np.ones((2, 2))),
        st.just(np.array(["ok", "ok", "motion"])),
        st.just(np.array(["ok", 1.0, ""], dtype=object)),
        st.just({"nested": 1.0}),
        st.just(np.ones(3) + 1j),
    )
    names = st.sampled_from([*GATED, *FREE, "other"])

    @settings(max_examples=examples, **KNOBS)
    @given(st.dictionaries(names, values, min_size=1, max_size=9), st.booleans())
    def check(variables: dict[str, object], struct: bool) -> None:
        table = columns(good_table()[:3])
        savemat(folder / "S.mat", {"rec": table | variables} if struct else table | variables)
        read(folder / "S.mat")

    check()


def other_layouts(folder: Path, examples: int) -> None:
    """Good and bad tables under mappings that fit and that do not."""
    names = st.one_of(st.sampled_from([*GATED, *FREE, "shear_modulus_kpa", "subject"]), st.text(max_size=6))
    units = st.sampled_from(["m/s", "cm/s", "mm/s", "kPa", "Pa", "s", "ms", "%", "furlongs"])
    constants = st.one_of(st.sampled_from(["ok", "counted", "0"]), st.integers(-1, 9), NUMBERS)
    table = st.fixed_dictionaries(
        {},
        optional={
            "first_phase": st.integers(-1, 2),
            "header_row": st.integers(-1, 4),
            "statuses": st.dictionaries(STATUSES, STATUSES, max_size=2),
            "values": st.dictionaries(names, constants, max_size=2),
            "samples": st.lists(st.dictionaries(names, names, max_size=2), max_size=3),
        },
    )
    said = st.fixed_dictionaries(
        {},
        optional={
            "columns": st.dictionaries(names, st.one_of(names, st.lists(names, max_size=2)), max_size=2),
            "units": st.dictionaries(names, units, max_size=2),
            "table": table,
        },
    )

    @settings(max_examples=examples, **KNOBS)
    @given(said, csv_texts(), st.sampled_from(["csv", "free csv", ""]))
    def check(plain: dict[str, object], text: str, form: str) -> None:
        path = folder / "S.csv"
        path.write_bytes(good_bytes(form) if form else text.encode("utf-8", "surrogatepass"))
        try:
            layout = layout_of(plain, folder / "recording.yaml")
        except RecordingError as error:
            assert "recording.yaml" in str(error)
            return
        read(path, layout)

    check()


def any_subjects(folder: Path, examples: int) -> None:
    good = "\n".join([HEADER, *ROWS.values()]).encode()
    cells = st.one_of(NUMBERS, STATUSES, st.sampled_from(["F", "M", "S-1", "60", "90", "34", "0.8"]))
    rows = st.lists(st.lists(cells, min_size=8, max_size=8).map(",".join), max_size=4)
    texts = rows.map(lambda lines: "\n".join([HEADER, *lines]).encode("utf-8", "surrogatepass"))

    @settings(max_examples=examples, **KNOBS)
    @given(st.one_of(edited(good), texts))
    def check(raw: bytes) -> None:
        path = folder / "subjects.csv"
        path.write_bytes(raw)
        try:
            subjects = read_subjects(path)
        except RecordingError as error:
            assert "subjects.csv" in str(error)
        else:
            assert all(subject.lvesv_ml < subject.lvedv_ml for subject in subjects)
            assert all("/" not in subject.subject and subject.subject for subject in subjects)

    check()


def any_measures(folder: Path, examples: int) -> None:
    names = st.sampled_from(["sbp_mmhg", "dbp_mmhg", "lvet_ms", "sbp", "lvet_s", "other", ""])
    likely = st.sampled_from(["", "NaN", "118", "74", "118", "74", "300", "0.3", "15.7", "9.9", "low"])
    cells, good = st.one_of(likely, NUMBERS), st.just(["118", "74", "300", ""])
    seen = []

    @settings(max_examples=examples, **KNOBS)
    @given(
        st.one_of(st.just(["sbp_mmhg", "dbp_mmhg", "lvet_ms"]), st.lists(names, max_size=4, unique=True)),
        st.lists(st.one_of(good, st.lists(cells, min_size=4, max_size=4)), min_size=1, max_size=8),
    )
    def check(columns: list[str], filled: list[list[str]]) -> None:
        path = folder / "subjects.csv"
        row = ROWS["S-1"].removeprefix("S-1")
        lines = [",".join([f"S-{number}{row}", *own[: len(columns)]]) for number, own in enumerate(filled)]
        text = "\n".join([",".join([HEADER, *columns]), *lines])
        path.write_text(text, encoding="utf-8", errors="surrogatepass", newline="")
        try:
            table = read_subject_table(path)
        except RecordingError as error:
            assert "subjects.csv" in str(error)
            return
        assert table.rows.keys() == table.clinical.keys()
        for measured in (own.to_measures() for own in table.clinical.values()):
            alone = math.isnan(measured.sbp_mmhg) != math.isnan(measured.dbp_mmhg)
            assert not alone and not measured.dbp_mmhg >= measured.sbp_mmhg
            assert not measured.has_ejection_time or 100.0 <= measured.lvet_ms <= 500.0
            seen.append(measured.has_pressures)

    check()
    assert any(seen)


def any_yaml(folder: Path, examples: int) -> None:
    @settings(max_examples=examples, **KNOBS)
    @given(st.one_of(edited(PROTOCOL.encode()), st.binary(max_size=40), st.text(max_size=40).map(str.encode)))
    def check(raw: bytes) -> None:
        (folder / "recording.yaml").write_bytes(raw)
        try:
            assert description_of(folder, "", RECORDING).file.origin
        except RecordingError as error:
            assert "recording.yaml" in str(error)

    check()


def any_own_yaml(folder: Path, examples: int) -> None:
    """Whatever a recording says of itself, the others stay."""
    cohort = kinds.good(folder / "cohort")
    keys = st.sampled_from(["columns", "units", "table", "noise", "protocol", "values", "file", "x", *FREE])
    leaves = st.one_of(
        st.none(), st.booleans(), st.integers(-2, 40), st.floats(), keys, st.sampled_from(["s", "c *", ""])
    )
    inner = st.recursive(
        leaves,
        lambda one: st.lists(one, max_size=3) | st.dictionaries(keys, one, max_size=4),
        max_leaves=12,
    )
    own = st.sampled_from(["protocol", "columns", "units", "table", "noise", "origin"])

    @settings(max_examples=max(examples // 5, 20), **KNOBS)
    @given(st.dictionaries(own, inner, max_size=4), st.sampled_from(["S-1", "s_2x", "S-3"]))
    def check(said: dict[str, object], subject: str) -> None:
        path = cohort / "swe" / f"{subject}.yaml"
        before = path.read_text() if path.exists() else None
        path.write_text(yaml.safe_dump(said))
        try:
            report = examine_cohort(cohort, free_case.QUALITY, 100)
        finally:
            path.unlink() if before is None else path.write_text(before)
        assert {"S-1", "s_2x", "S-3"} - {subject} <= set(report.usable)
        assert all(subject in str(problem) for problem in report.problems)

    check()


# what is fuzzed, and its share of the examples
PARSERS: dict[str, tuple[Callable[[Path, int], None], float]] = {
    "any CSV": (any_csv, 0.4),
    "any bytes": (any_bytes, 0.05),
    "damaged CSV": (functools.partial(damaged, "csv"), 0.1),
    "damaged push train": (functools.partial(damaged, "free csv"), 0.1),
    "damaged MATLAB 5": (functools.partial(damaged, "mat"), 0.15),
    "damaged MATLAB 7.3": (functools.partial(damaged, "v73 mat"), 0.1),
    "damaged workbook": (functools.partial(damaged, "xlsx"), 0.15),
    "allowed values": (allowed_values, 0.05),
    "allowed pushes": (allowed_pushes, 0.1),
    "values of MATLAB": (matlab_values, 0.05),
    "other layouts": (other_layouts, 0.3),
    "subjects": (any_subjects, 0.1),
    "clinical measures": (any_measures, 0.1),
    "recording.yaml": (any_yaml, 0.1),
    "YAML of one recording": (any_own_yaml, 0.2),
}


@pytest.mark.parametrize("fuzzed", PARSERS)
def test_it_is_read_or_refused(fuzzed: str, tmp_path: Path) -> None:
    fuzz, share = PARSERS[fuzzed]
    fuzz(tmp_path, int(FAST * share))


@pytest.mark.parametrize(
    "examples",
    [pytest.param(SLOW, marks=pytest.mark.slow), pytest.param(EXHAUSTIVE, marks=pytest.mark.exhaustive)],
)
@pytest.mark.parametrize("fuzzed", PARSERS)
def test_thousands_are_read_or_refused(fuzzed: str, examples: int, tmp_path: Path) -> None:
    fuzz, share = PARSERS[fuzzed]
    fuzz(tmp_path, int(examples * share))
