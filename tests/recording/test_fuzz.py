"""Whatever a file holds, it is read as valid or refused: tables, workbooks, MATLAB, subjects, YAML."""

from __future__ import annotations

import functools
import io
import math
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import free_case
import numpy as np
import pandas as pd
import pytest
import yaml
from cohorts import HEADER, PROTOCOL, ROWS, columns, recording, write_v73
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings import CONTEXT, DENSITY, RECORDING
from scipy.io import savemat

from swesbi.recording.cohort.check import examine_cohort
from swesbi.recording.cohort.recording_file import description_of, validated
from swesbi.recording.cohort.subjects import read_subject_table
from swesbi.recording.cohort.visits import persons_of
from swesbi.recording.ingest import ingest, ingest_pushes
from swesbi.recording.observation import SOURCES, Observation
from swesbi.recording.problems import RecordingError
from swesbi.recording.reader import samples_in
from swesbi.recording.samples import Samples
from swesbi.recording.settings import NoiseDeclaration
from swesbi.recording.tables.files import open_table
from swesbi.recording.tables.layout import (
    COLUMNS,
    EVENT,
    FAILED_STATUSES,
    FREE_COLUMNS,
    MODULUS,
    OWN_FORM,
    TableLayout,
)

PHASES = 8
FAST, SLOW, EXHAUSTIVE = 300, 2_000, 10_000
GATED = [*COLUMNS, MODULUS]
FREE = [*FREE_COLUMNS, MODULUS, EVENT]
ODD = ["", "NaN", "inf", "1,5", "1.5", "1e999", "0x1", "1_0", "٣", "+.5", "--1", "9" * 400, "1\u202f0", '"1']
NUMBERS = st.one_of(
    st.floats().map(repr), st.integers(-3, 40).map(str), st.sampled_from([*ODD, "1%"]), st.text(max_size=6)
)
LIKELY = st.sampled_from(["0.5", "1", "2.5", "300", "980", "1000", "1050"])
STATUSES = st.one_of(st.sampled_from(["ok", *FAILED_STATUSES]), st.text(max_size=4))
DECLARED = st.sampled_from(
    [NoiseDeclaration(), NoiseDeclaration(fit_points=3), NoiseDeclaration(cv_fraction=0.5, cv_log_sd=1.5)]
)


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
    elif form == "v73 mat":
        with tempfile.TemporaryDirectory() as folder:
            write_v73(Path(folder) / "S.mat", good_table()[:40])
            return (Path(folder) / "S.mat").read_bytes()
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
def edited(draw: st.DrawFn, form: str) -> bytes:
    """A good file with a few bytes changed, cut out or put in, or cut off."""
    texts = {"recording.yaml": PROTOCOL, "subjects.csv": "\n".join([HEADER, *ROWS.values()])}
    content = bytearray(texts[form].encode() if form in texts else good_bytes(form))
    for _ in range(draw(st.integers(1, 3))):
        start = draw(st.integers(0, max(len(content) - 1, 0)))
        stop = start + draw(st.sampled_from([0, 0, 1, 1, 1, 2, 5, 30, len(content)]))
        content[start:stop] = draw(st.binary(max_size=4))
    return bytes(content)


@st.composite
def near_tables(draw: st.DrawFn) -> bytes:
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
    return table.sample(frac=kept, random_state=draw(st.integers(0, 9))).to_csv(index=False).encode()


def encoded(text: str) -> bytes:
    return text.encode("utf-8", "surrogatepass")


def of_file(name: str) -> Callable[[Path, bytes], bool]:
    """Read a file of this content."""

    def check(folder: Path, raw: bytes) -> bool:
        (folder / name).unlink(missing_ok=True)
        (folder / name).write_bytes(raw)
        return read(folder / name)

    return check


def any_csv(folder: Path, made: tuple[str, NoiseDeclaration]) -> bool:
    (folder / "S.csv").write_bytes(encoded(made[0]))
    return read(folder / "S.csv", declared=made[1])


def any_bytes(folder: Path, made: tuple[bytes, str]) -> bool:
    assert not of_file(f"S{made[1]}")(folder, made[0])
    return False


PUSH = st.tuples(st.floats(0.0, 1200.0), st.floats(850.0, 1150.0), st.floats(0.3, 8.0), st.floats(1e-6, 1.0))


def allowed_pushes(folder: Path, pushes: list[tuple[float, ...]]) -> bool:
    lines = ["time_ms,rr_ms,shear_wave_speed_m_s,se_m_s", *(",".join(map(repr, row)) for row in pushes)]
    (folder / "S.csv").write_text("\n".join(lines), encoding="utf-8")
    return read(folder / "S.csv", declared=NoiseDeclaration())


VARIABLES = st.one_of(
    st.floats().map(lambda value: np.full((1, 3), value)),
    st.lists(st.integers(-2, 9), min_size=3, max_size=3).map(lambda items: np.array(items, dtype=np.int16)),
    st.just(np.zeros((0, 0))),
    st.just(np.ones((2, 2))),
    st.just(np.array(["ok", "ok", "motion"])),
    st.just(np.array(["ok", 1.0, ""], dtype=object)),
    st.just({"nested": 1.0}),
    st.just(np.ones(3) + 1j),
)
MATLAB = st.tuples(
    st.dictionaries(st.sampled_from([*GATED, *FREE, "other"]), VARIABLES, min_size=1, max_size=9),
    st.booleans(),
)


def matlab_values(folder: Path, made: tuple[dict[str, object], bool]) -> bool:
    variables, struct = columns(good_table()[:3]) | made[0], made[1]
    savemat(folder / "S.mat", {"rec": variables} if struct else variables)
    return read(folder / "S.mat")


NAMES = st.one_of(st.sampled_from([*GATED, *FREE, "shear_modulus_kpa", "subject"]), st.text(max_size=6))
UNITS = st.sampled_from(["m/s", "cm/s", "mm/s", "kPa", "Pa", "s", "ms", "%", "furlongs"])
CONSTANTS = st.one_of(st.sampled_from(["ok", "counted", "0"]), st.integers(-1, 9), NUMBERS)
TABLE = {
    "first_phase": st.integers(-1, 2),
    "header_row": st.integers(-1, 4),
    "statuses": st.dictionaries(STATUSES, STATUSES, max_size=2),
    "values": st.dictionaries(NAMES, CONSTANTS, max_size=2),
    "samples": st.lists(st.dictionaries(NAMES, NAMES, max_size=2), max_size=3),
}
LAYOUT = {
    "columns": st.dictionaries(NAMES, st.one_of(NAMES, st.lists(NAMES, max_size=2)), max_size=2),
    "units": st.dictionaries(NAMES, UNITS, max_size=2),
    "table": st.fixed_dictionaries({}, optional=TABLE),
}
LAYOUTS = st.tuples(
    st.fixed_dictionaries({}, optional=LAYOUT), csv_texts(), st.sampled_from(["csv", "free csv", ""])
)


def other_layouts(folder: Path, made: tuple[dict[str, object], str, str]) -> bool:
    """Good and bad tables under mappings that fit and that do not."""
    plain, text, form = made
    (folder / "S.csv").write_bytes(good_bytes(form) if form else encoded(text))
    try:
        layout = validated(TableLayout, plain, folder / "recording.yaml")
    except RecordingError as error:
        assert "recording.yaml" in str(error)
        return False
    return read(folder / "S.csv", layout)


CELLS = st.one_of(NUMBERS, STATUSES, st.sampled_from(["F", "M", "S-1", "60", "90", "34", "0.8"]))
SUBJECTS = st.lists(st.lists(CELLS, min_size=8, max_size=8).map(",".join), max_size=4).map(
    lambda lines: encoded("\n".join([HEADER, *lines]))
)
MEASURE_NAMES = st.sampled_from(["sbp_mmhg", "dbp_mmhg", "lvet_ms", "sbp", "lvet_s", "other", ""])
MEASURE = st.sampled_from(["", "NaN", "118", "74", "118", "74", "300", "0.3", "15.7", "9.9", "low"])
MEASURES = st.tuples(
    st.one_of(st.just(["sbp_mmhg", "dbp_mmhg", "lvet_ms"]), st.lists(MEASURE_NAMES, max_size=4, unique=True)),
    st.lists(
        st.one_of(
            st.just(["118", "74", "300", ""]), st.lists(st.one_of(MEASURE, NUMBERS), min_size=4, max_size=4)
        ),
        min_size=1,
        max_size=8,
    ),
)
PERSON = st.sampled_from(["", "", "P", "p", "Q", "S-1", "before", "after", "NaN", " x ", "1,5", "ß"])
GOOD_VISITS = [("P", "before", "x"), ("P", "after", "x"), ("Q", "before", ""), ("", "", "x")]
VISIT = st.one_of(st.sampled_from(GOOD_VISITS), st.tuples(PERSON, PERSON, PERSON))
AGES = st.lists(st.integers(20, 22), min_size=5, max_size=5)
VISITS = st.tuples(
    st.one_of(st.permutations(GOOD_VISITS), st.lists(VISIT, min_size=1, max_size=5)),
    st.one_of(AGES, AGES.map(sorted)),
    st.one_of(st.just("F" * 5), st.text("FM", min_size=5, max_size=5)),
)


def any_subjects(folder: Path, raw: bytes) -> bool:
    """Read a table of subjects with what is measured of each, and their visits."""
    path = folder / "subjects.csv"
    path.write_bytes(raw)
    try:
        table = read_subject_table(path)
    except RecordingError as error:
        assert str(path) in str(error)
        return False
    assert table.rows.keys() == table.clinical.keys() == table.visits.keys()
    for name, row in table.rows.items():
        assert name and "/" not in name and row.lvesv_ml < row.lvedv_ml
        measured = table.clinical[name].to_measures()
        alone = math.isnan(measured.sbp_mmhg) != math.isnan(measured.dbp_mmhg)
        assert not alone and not measured.dbp_mmhg >= measured.sbp_mmhg
        assert not measured.has_ejection_time or 100.0 <= measured.lvet_ms <= 500.0
    persons = persons_of(table.visits)
    order = list(table.rows)
    assert sorted(name for person in persons for name in person.subjects) == sorted(order)
    assert len({person.name.lower() for person in persons}) == len(persons)
    for person in persons:
        rows = [table.rows[name] for name in person.subjects]
        ages = [row.age_years for row in rows]
        assert list(person.subjects) == sorted(person.subjects, key=order.index)
        assert len({row.sex for row in rows}) == 1 and ages == sorted(ages)
        assert {table.visits[name].group for name in person.subjects} == {person.group}
        assert len(rows) == 1 or (all(person.visits) and len(set(person.visits)) == len(rows))
    return True


def any_measures(folder: Path, made: tuple[list[str], list[list[str]]]) -> bool:
    names, filled = made
    row = ROWS["S-1"].removeprefix("S-1")
    lines = [",".join([f"S-{number}{row}", *own[: len(names)]]) for number, own in enumerate(filled)]
    pressures = names[:2] == ["sbp_mmhg", "dbp_mmhg"] and filled[0][:2] == ["118", "74"]
    return any_subjects(folder, encoded("\n".join([",".join([HEADER, *names]), *lines]))) and pressures


def any_visits(folder: Path, made: tuple[list[tuple[str, ...]], list[int], str]) -> bool:
    lines = [f"{HEADER},person,visit,group"]
    for number, (cells, age, sex) in enumerate(zip(*made, strict=False)):
        quoted = ",".join(f'"{cell}"' for cell in cells)
        lines.append(f"S-{number},{sex},{age},1.7,60,90,34,0.8,{quoted}")
    several = [cells[0] for cells in made[0]].count("P") > 1
    return any_subjects(folder, encoded("\n".join(lines))) and several


def any_yaml(folder: Path, raw: bytes) -> bool:
    (folder / "recording.yaml").write_bytes(raw)
    try:
        assert description_of(folder, "", RECORDING).file.origin
    except RecordingError as error:
        assert "recording.yaml" in str(error)
        return False
    return True


KEYS = st.sampled_from(["columns", "units", "table", "noise", "protocol", "values", "file", "x", *FREE])
LEAVES = st.one_of(
    st.none(), st.booleans(), st.integers(-2, 40), st.floats(), KEYS, st.sampled_from(["s", "c *", ""])
)
SAID = st.recursive(
    LEAVES, lambda one: st.lists(one, max_size=3) | st.dictionaries(KEYS, one, max_size=4), max_leaves=12
)
OWN = st.sampled_from(["protocol", "columns", "units", "table", "noise", "origin"])


def own_yaml(folder: Path, made: tuple[dict[str, object], str]) -> bool:
    """Whatever a recording says of itself, the others stay."""
    said, subject = made
    cohort = folder / "cohort"
    if not cohort.exists():
        free_case.mixed(cohort)
    path = cohort / "swe" / f"{subject}.yaml"
    before = path.read_text() if path.exists() else None
    path.write_text(yaml.safe_dump(said))
    try:
        report = examine_cohort(cohort, free_case.QUALITY, 100)
    finally:
        path.unlink() if before is None else path.write_text(before)
    assert {"S-1", "s_2x", "S-3"} - {subject} <= set(report.usable)
    assert all(subject in str(problem) for problem in report.problems)
    return subject in report.usable


@dataclass(frozen=True)
class Fuzzed:
    """What is made, how it is read, its share of the examples, and whether some must be read and refused."""

    made: st.SearchStrategy[Any]
    read: Callable[[Path, Any], bool]
    share: float
    both: bool = False


PARSERS = {
    "any CSV": Fuzzed(st.tuples(csv_texts(), DECLARED), any_csv, 0.4),
    "any bytes": Fuzzed(
        st.tuples(st.binary(max_size=60), st.sampled_from([".csv", ".mat", ".xlsx"])), any_bytes, 0.05
    ),
    "damaged CSV": Fuzzed(edited("csv"), of_file("S.csv"), 0.1),
    "damaged push train": Fuzzed(edited("free csv"), of_file("S.csv"), 0.1),
    "damaged MATLAB 5": Fuzzed(edited("mat"), of_file("S.mat"), 0.15),
    "damaged MATLAB 7.3": Fuzzed(edited("v73 mat"), of_file("S.mat"), 0.1),
    "damaged workbook": Fuzzed(edited("xlsx"), of_file("S.xlsx"), 0.15),
    "allowed values": Fuzzed(near_tables(), of_file("S.csv"), 0.05, both=True),
    "allowed pushes": Fuzzed(st.lists(PUSH, min_size=1, max_size=12), allowed_pushes, 0.1, both=True),
    "values of MATLAB": Fuzzed(MATLAB, matlab_values, 0.05),
    "other layouts": Fuzzed(LAYOUTS, other_layouts, 0.3),
    "subjects": Fuzzed(st.one_of(edited("subjects.csv"), SUBJECTS), any_subjects, 0.1),
    "clinical measures": Fuzzed(MEASURES, any_measures, 0.1, both=True),
    "visits": Fuzzed(VISITS, any_visits, 0.25, both=True),
    "recording.yaml": Fuzzed(
        st.one_of(edited("recording.yaml"), st.binary(max_size=40), st.text(max_size=40).map(str.encode)),
        any_yaml,
        0.1,
    ),
    "YAML of one recording": Fuzzed(
        st.tuples(st.dictionaries(OWN, SAID, max_size=4), st.sampled_from(["S-1", "s_2x", "S-3"])),
        own_yaml,
        0.07,
    ),
}


@pytest.mark.parametrize(
    "examples",
    [
        FAST,
        pytest.param(SLOW, marks=pytest.mark.slow),
        pytest.param(EXHAUSTIVE, marks=pytest.mark.exhaustive),
    ],
)
@pytest.mark.parametrize("name", PARSERS)
def test_it_is_read_or_refused(name: str, examples: int, tmp_path: Path) -> None:
    fuzzed = PARSERS[name]
    seen = set()

    @settings(max_examples=int(fuzzed.share * examples), derandomize=True, database=None, deadline=None)
    @given(fuzzed.made)
    def check(made: object) -> None:
        seen.add(fuzzed.read(tmp_path, made))

    check()
    assert not fuzzed.both or seen == {True, False}
