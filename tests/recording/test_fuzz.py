"""Whatever a file holds, a parser returns valid samples or says what is wrong; it never fails otherwise."""

from __future__ import annotations

import functools
import io
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from cohorts import HEADER, PROTOCOL, ROWS, columns, recording, write_v73
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from recordings import CONTEXT, DENSITY, RECORDING
from scipy.io import savemat

from swesbi.recording.cohort import read_subject_table, read_subjects
from swesbi.recording.columns import COLUMNS, FAILED_STATUSES, MODULUS
from swesbi.recording.ingest import ingest
from swesbi.recording.layout import TableLayout, layout_of
from swesbi.recording.problems import RecordingError
from swesbi.recording.protocol import read_protocol
from swesbi.recording.reader import OWN_FORM, read_samples
from swesbi.recording.samples import Samples

PHASES = 8
FAST, SLOW, EXHAUSTIVE = 300, 2_000, 10_000
NUMBERS = st.one_of(
    st.floats().map(repr),
    st.integers(-3, 40).map(str),
    st.sampled_from(["", "NaN", "inf", "1,5", "1.5", "1e999", "0x1", "1_0", "٣", "+.5", "--1", "9" * 400]),
    st.text(max_size=6),
)
STATUSES = st.one_of(st.sampled_from(["ok", *FAILED_STATUSES]), st.text(max_size=4))
SIGNS = st.sampled_from([",", ";", "\t"])
KNOBS: dict[str, Any] = {
    "derandomize": True,
    "database": None,
    "deadline": None,
    "suppress_health_check": [HealthCheck.function_scoped_fixture],
}


def valid(samples: Samples) -> None:
    """What every recording that was read must fulfil."""
    shape = samples.phase_index.shape
    assert len(shape) == 1
    assert shape[0] > 0
    assert ((samples.phase_index >= 0) & (samples.phase_index < PHASES)).all()
    assert ((samples.rr_ms >= 150) & (samples.rr_ms <= 5000)).all()
    assert ((samples.trigger_delay_ms >= 0) & (samples.trigger_delay_ms <= 5000)).all()
    assert (np.isnan(samples.speed_m_s) | ((samples.speed_m_s > 0.0499) & (samples.speed_m_s < 30.001))).all()
    assert (np.isnan(samples.fit_r2) | (np.abs(samples.fit_r2) <= 1)).all()
    assert np.isin(samples.status, ["ok", *FAILED_STATUSES]).all()
    triples = np.stack([samples.phase_index, samples.repeat, samples.sample])
    assert len(np.unique(triples, axis=1).T) == shape[0]


def read(path: Path, layout: TableLayout = OWN_FORM) -> bool:
    """Read a recording; tell whether it was accepted."""
    try:
        samples = read_samples(path, PHASES, DENSITY, layout, "S")
    except RecordingError as error:
        assert str(path) in str(error)
        assert error.problems
        return False
    valid(samples)
    try:
        observed = ingest(samples, CONTEXT, RECORDING.model_copy(update={"phases": PHASES}), 20)
        assert np.isfinite(observed.curve_kpa).all()
    except RecordingError as error:
        assert error.problems
    return True


@functools.cache
def good_table() -> pd.DataFrame:
    return recording(phases=PHASES)


@functools.cache
def good_bytes(form: str) -> bytes:
    """A good recording as a file of each format, held in memory."""
    if form == "csv":
        return good_table().to_csv(index=False).encode()
    buffer = io.BytesIO()
    if form == "v5":
        savemat(buffer, columns(good_table()))
    return buffer.getvalue()


@st.composite
def csv_texts(draw: st.DrawFn) -> str:
    """Tables of roughly the right shape: columns dropped, doubled or shuffled, cells of all kinds."""
    sign = draw(SIGNS)
    names = draw(st.permutations(list(COLUMNS)))
    names = names[: draw(st.sampled_from([8, 8, 8, 8, 7, 3]))]
    names += draw(st.lists(st.sampled_from([*COLUMNS, MODULUS, "other", ""]), max_size=1))
    rows = draw(
        st.lists(st.tuples(*(STATUSES if name == "status" else NUMBERS for name in names)), max_size=5)
    )
    lines = [sign.join(names), *(sign.join(row) for row in rows)]
    lines += draw(st.lists(st.one_of(st.just(""), st.just("# x"), st.text(max_size=8)), max_size=1))
    return draw(st.sampled_from(["", "\ufeff", "\n"])) + draw(st.sampled_from(["\n", "\r\n", "\r"])).join(
        lines
    )


@st.composite
def edited(draw: st.DrawFn, raw: bytes) -> bytes:
    """A good file with a few bytes changed, cut out or put in."""
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
    @given(csv_texts())
    def check(text: str) -> None:
        path = folder / "S.csv"
        path.write_text(text, encoding="utf-8", errors="surrogatepass", newline="")
        read(path)

    check()


def any_bytes(folder: Path, examples: int) -> None:
    @settings(max_examples=examples, **KNOBS)
    @given(st.binary(max_size=60), st.sampled_from([".csv", ".mat"]))
    def check(raw: bytes, suffix: str) -> None:
        path = folder / f"S{suffix}"
        path.write_bytes(raw)
        assert not read(path)

    check()


def damaged(form: str, folder: Path, examples: int) -> None:
    suffix = ".csv" if form == "csv" else ".mat"
    raw = good_bytes(form)
    if form == "v73":
        write_v73(folder / "good.mat", good_table()[:40])
        raw = (folder / "good.mat").read_bytes()

    @settings(max_examples=examples, **KNOBS)
    @given(edited(raw))
    def check(content: bytes) -> None:
        path = folder / f"S{suffix}"
        path.unlink(missing_ok=True)
        path.write_bytes(content)
        read(path)

    check()


def damaged_csv(folder: Path, examples: int) -> None:
    damaged("csv", folder, examples)


def damaged_v5(folder: Path, examples: int) -> None:
    damaged("v5", folder, examples)


def damaged_v73(folder: Path, examples: int) -> None:
    damaged("v73", folder, examples)


def allowed_values(folder: Path, examples: int) -> None:
    seen = []

    @settings(max_examples=examples, **KNOBS)
    @given(near_tables())
    def check(table: pd.DataFrame) -> None:
        table.to_csv(folder / "S.csv", index=False)
        seen.append(read(folder / "S.csv"))

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
    names = st.sampled_from([*COLUMNS, MODULUS, "other"])

    @settings(max_examples=examples, **KNOBS)
    @given(st.dictionaries(names, values, min_size=1, max_size=9), st.booleans())
    def check(variables: dict[str, object], struct: bool) -> None:
        table = columns(good_table()[:3])
        savemat(folder / "S.mat", {"rec": table | variables} if struct else table | variables)
        read(folder / "S.mat")

    check()


@functools.cache
def good_workbook() -> bytes:
    buffer = io.BytesIO()
    good_table().to_excel(buffer, index=False)
    return buffer.getvalue()


def damaged_workbook(folder: Path, examples: int) -> None:
    @settings(max_examples=examples, **KNOBS)
    @given(edited(good_workbook()))
    def check(raw: bytes) -> None:
        (folder / "S.xlsx").write_bytes(raw)
        read(folder / "S.xlsx")

    check()


def other_layouts(folder: Path, examples: int) -> None:
    """Good and bad tables under mappings that fit and that do not."""
    names = st.one_of(
        st.sampled_from([*COLUMNS, MODULUS, "shear_modulus_kpa", "subject"]), st.text(max_size=6)
    )
    sources = st.one_of(names, st.just("shear*"), st.text(max_size=4), st.lists(names, max_size=3))
    units = st.sampled_from(["m/s", "cm/s", "mm/s", "kPa", "Pa", "s", "ms", "%", "furlongs"])
    constants = st.one_of(st.sampled_from(["ok", "counted", "0"]), st.integers(-1, 9), NUMBERS)
    table = st.fixed_dictionaries(
        {},
        optional={
            "first_phase": st.integers(-1, 2),
            "header_row": st.integers(-1, 4),
            "statuses": st.dictionaries(STATUSES, STATUSES, max_size=2),
            "values": st.dictionaries(names, constants, max_size=2),
        },
    )
    said = st.fixed_dictionaries(
        {},
        optional={
            "columns": st.dictionaries(names, sources, max_size=2),
            "units": st.dictionaries(names, units, max_size=2),
            "table": table,
        },
    )

    @settings(max_examples=examples, **KNOBS)
    @given(said, csv_texts(), st.booleans())
    def check(plain: dict[str, object], text: str, good: bool) -> None:
        path = folder / "S.csv"
        path.write_bytes(good_bytes("csv") if good else text.encode("utf-8", "surrogatepass"))
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


def any_protocol(folder: Path, examples: int) -> None:
    @settings(max_examples=examples, **KNOBS)
    @given(st.one_of(edited(PROTOCOL.encode()), st.binary(max_size=40), st.text(max_size=40).map(str.encode)))
    def check(raw: bytes) -> None:
        (folder / "recording.yaml").write_bytes(raw)
        try:
            assert read_protocol(folder, RECORDING).origin
        except RecordingError as error:
            assert "recording.yaml" in str(error)

    check()


# what is fuzzed, and its share of the examples
PARSERS: dict[Callable[[Path, int], None], float] = {
    any_csv: 0.3,
    any_bytes: 0.05,
    damaged_csv: 0.15,
    damaged_v5: 0.15,
    damaged_v73: 0.1,
    allowed_values: 0.05,
    matlab_values: 0.05,
    damaged_workbook: 0.05,
    other_layouts: 0.2,
    any_subjects: 0.1,
    any_measures: 0.1,
    any_protocol: 0.05,
}


@pytest.mark.parametrize("fuzz", PARSERS)
def test_a_parser_reads_or_refuses(fuzz: Callable[[Path, int], None], tmp_path: Path) -> None:
    fuzz(tmp_path, int(FAST * PARSERS[fuzz]))


@pytest.mark.parametrize(
    "examples",
    [pytest.param(SLOW, marks=pytest.mark.slow), pytest.param(EXHAUSTIVE, marks=pytest.mark.exhaustive)],
)
@pytest.mark.parametrize("fuzz", PARSERS)
def test_a_parser_reads_or_refuses_thousands(
    fuzz: Callable[[Path, int], None], examples: int, tmp_path: Path
) -> None:
    fuzz(tmp_path, int(examples * PARSERS[fuzz]))
