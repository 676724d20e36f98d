"""The reference of the settings: every shipped key, ranges that are in force, and a page that is current."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from annotated_types import Ge, Gt, Le, Lt
from study_copy import ROOT

from swesbi.config.read import overlay, parts_of, read_merged, read_yaml
from tools.settings import INLINE, MARK, MARKED, PAGE, STUDIES, Section, main, reference, sections

SECTIONS = sections()
SIGNS = {"≥": Ge, ">": Gt, "≤": Le, "<": Lt}
FILES = [*parts_of(ROOT / "config.yaml"), *(ROOT / "studies" / name / "config.yaml" for name in STUDIES)]


def keys_of(value: object, place: str = "") -> Iterator[tuple[str, str]]:
    """Yield every key below a value, with the place of what holds it."""
    if isinstance(value, Mapping):
        for key, below in value.items():
            yield place, str(key)
            yield from keys_of(below, f"{place}.{key}".removeprefix("."))


def shipped() -> dict[str, Any]:
    studies = {name: read_yaml(ROOT / "studies" / name / "config.yaml")[name] for name in STUDIES}
    return read_merged(ROOT / "config.yaml") | studies


def lacking(given: Mapping[str, Any]) -> list[str]:
    """Return the keys of a configuration that the reference does not have."""
    rows = {(place, row.key) for section in SECTIONS for place in section.places for row in section.rows}
    values = {
        f"{place}.{row.key}".removeprefix("."): shown
        for section in SECTIONS
        for row in section.rows
        for place, shown in row.shipped.items()
    }
    found = []
    for place, key in keys_of(given):
        # names that stand for a place, those of structures say, and keys within a value that is shown whole
        named = any(f"{place}.{key}".removeprefix(".") in section.places for section in SECTIONS)
        above = (values[part] for part in values if f"{place}.".startswith(f"{part}."))
        within = any(re.search(rf"(?:^|\W){re.escape(key)}\b", shown) for shown in above)
        if not ((place, key) in rows or named or within or ".changes" in place):
            found.append(f"{place}.{key}".removeprefix("."))
    return found


def test_every_shipped_key_has_a_row_or_stands_in_a_value() -> None:
    assert lacking(shipped()) == []
    more = {"recording": {"fases": 20}, "priors": {"wide": {"k0_kpa": {"middle": 1.0}}}, "colour": "red"}
    assert lacking(overlay(shipped(), more)) == ["priors.wide.k0_kpa.middle", "recording.fases", "colour"]


def test_every_row_has_a_meaning_and_every_number_a_unit() -> None:
    for section in SECTIONS:
        for row in section.rows:
            assert row.meaning, (section.model, row.key)
            assert row.unit or "number" not in row.allowed, (section.model, row.key)


@pytest.mark.parametrize("section", SECTIONS, ids=lambda each: f"{each.model.__name__} of {each.file}")
def test_the_range_that_is_shown_is_in_force(section: Section) -> None:
    for row in section.rows:
        constraints = section.model.model_fields[row.key].metadata
        in_force = {(type(one), limit_of(one)) for one in constraints if type(one) in SIGNS.values()}
        of_items = row.allowed.startswith(("list", "names", "["))
        told = {} if of_items else set(re.findall(r"([≥>≤<]) (-?[\d.e+-]+)", row.allowed))
        assert {(SIGNS[sign], float(limit)) for sign, limit in told} == in_force, row


def limit_of(constraint: object) -> float:
    return float(getattr(constraint, type(constraint).__name__.lower()))


def test_ranges_of_items_and_of_several_types_are_told() -> None:
    told = {(section.model.__name__, row.key): row.allowed for section in SECTIONS for row in section.rows}
    assert told["RecoverySettings", "nominal_levels"] == "list of at least 1: number > 0 and < 1"
    assert told["NewSubjectsSettings", "phases"] == "whole number ≥ 8 and ≤ 60 or null"
    assert told["ForwardModelSettings", "geometry"] == "midwall or thin"
    assert told["RecordingSettings", "late_diastolic_window"] == "[start, end] with 0 ≤ start < end ≤ 1"
    assert told["ObservationModelSettings", "feature_noise_sd"] == "names, each with number ≥ 0"


def test_a_value_that_differs_by_place_is_shown_with_its_places() -> None:
    exact = next(section for section in SECTIONS if section.places[0] == "experiments.calibrated.exact")
    assert exact.places[1:] == ("cohort_posterior.exact", "changes.exact")
    row = next(row for row in exact.rows if row.key == "first_draws")
    assert set(row.shipped.values()) == {"1000", "2000", "4000"}
    assert "1000 (experiments.calibrated)<br>2000 (cohort_posterior)<br>4000 (changes)" in reference()


def test_the_page_is_current() -> None:
    page = (ROOT / "docs" / PAGE).read_text(encoding="utf-8")
    match = MARKED.search(page)
    assert match is not None and match[2].strip() == reference().strip(), "run `python -m tools.settings`"


def test_the_page_is_written_where_asked(tmp_path: Path) -> None:
    (tmp_path / PAGE).write_text(f"before\n<!-- begin {MARK} -->\n<!-- end {MARK} -->\n", encoding="utf-8")
    assert main(["--docs", str(tmp_path)]) == 0
    written = (tmp_path / PAGE).read_text(encoding="utf-8")
    assert written.startswith("before\n") and "`late_diastolic_window`" in written


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_files_of_settings_hold_a_key_a_line_and_short_sources(path: Path) -> None:
    lines = path.read_text(encoding="utf-8").splitlines()
    comments = [number for number, line in enumerate(lines) if line.lstrip().startswith("#")]
    assert comments == list(range(len(comments))) and len(comments) <= 3
    sources = (line.rpartition(" # ")[2] for line in lines if " # " in line)
    assert all(len(source) <= 60 for source in sources)


def test_a_class_that_is_shown_whole_has_its_keys_once() -> None:
    shown = [section.model for section in SECTIONS if section.model in INLINE]
    assert sorted(map(str, shown)) == sorted(map(str, INLINE))
