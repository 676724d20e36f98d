"""The study of identifiability of a small cohort: artefact, tables and figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import speed_case
import xarray as xr
from identifiability_case import tiny

from swesbi.artefacts import Provenance
from swesbi.checks.identifiability.information import QUANTITY_NAMES
from swesbi.checks.identifiability.noise import MeanNoise
from swesbi.checks.identifiability.subject import (
    CohortIdentifiability,
    RecordedSubject,
    drawn,
    identify_cohort,
)
from swesbi.checks.identifiability.tables import (
    Identifiability,
    design_table,
    information_table,
    summary_table,
)

MISSING = 7


def _recorded(name: str, missing: int | None = None) -> RecordedSubject:
    model = speed_case.model()
    measured = np.arange(20) != (-1 if missing is None else missing)
    recording = replace(
        model.recording,
        context=replace(model.recording.context, subject=name),
        phase=model.recording.phase[measured],
        speed_m_s=model.recording.speed_m_s[measured],
        relative_se=model.recording.relative_se[measured],
        shared=model.recording.shared[measured],
    )
    sd = np.array([0.1, 0.2, 0.07, 0.03])
    phi = speed_case.PHI * np.exp(np.random.default_rng(1).normal(0.0, sd, (300, 4)))
    noise = MeanNoise(3.0 * speed_case.RELATIVE_SE**2)
    return RecordedSubject(replace(model, recording=recording), phi, model.recording.phase, measured, noise)


@cache
def _found() -> CohortIdentifiability:
    return identify_cohort([_recorded("A"), _recorded("B", MISSING)], tiny(), 1)


@cache
def _groups() -> Mapping[str, xr.Dataset]:
    return Identifiability.of(_found(), tiny()).datasets


def test_an_empty_cohort_is_refused() -> None:
    with pytest.raises(ValueError, match="empty"):
        identify_cohort([], tiny(), 1)


def test_repeats_are_told_from_the_standard_errors() -> None:
    assert _recorded("A").equivalent_repeats == pytest.approx(3.0)


def test_draws_depend_on_seed_subject_and_purpose_alone() -> None:
    one = _recorded("A")
    np.testing.assert_array_equal(drawn(one, 9, 1, "shown"), drawn(one, 9, 1, "shown"))
    for other in (drawn(one, 9, 2, "shown"), drawn(_recorded("B"), 9, 1, "shown"), drawn(one, 9, 1, "other")):
        assert not np.array_equal(drawn(one, 9, 1, "shown"), other)


def test_the_artefact_is_read_back(tmp_path: Path) -> None:
    path = tmp_path / "identifiability.h5"
    Identifiability.of(_found(), tiny()).write(path, Provenance(""))
    for name, group in Identifiability.read(path).datasets.items():
        xr.testing.assert_equal(group, _groups()[name])


def test_a_missing_phase_has_no_information() -> None:
    phases = _groups()["phases"]
    missing = phases["expected_sd_increase"].isnull().any("quantity").to_numpy()
    np.testing.assert_array_equal(np.argwhere(missing), [[1, MISSING]])
    assert len(information_table(phases)) == (20 + 19) * len(QUANTITY_NAMES)
    np.testing.assert_allclose(phases["share"].sum("phase"), 1.0)


def test_the_tables_hold_every_quantity_and_design() -> None:
    groups, sizes = _groups(), tiny().design
    summary = summary_table(groups["/"], groups["profile"]).set_index(["subject", "quantity"])
    assert len(summary) == 2 * len(QUANTITY_NAMES)
    ratio = summary["expected_sd_log"] / summary["sd_log"]
    np.testing.assert_allclose(summary["expected_over_found"], ratio)
    assert (
        summary.loc[("A", "k0_kpa"), "likelihood_low"]
        < 60.0
        < summary.loc[("A", "k0_kpa"), "likelihood_high"]
    )
    table = design_table(groups["design"], groups["placement"], 0.9)
    evenly = table[table["placement"] == "even"]
    assert len(evenly) == 2 * 2 * len(QUANTITY_NAMES) * len(sizes.phases) * (len(sizes.repeats) + 1)
    floor = evenly[np.isinf(evenly["repeats"])].drop(columns=["repeats", "fold"])
    keys = ["subject", "quantity", "placement", "model_errors", "phases"]
    both = evenly.merge(floor, on=keys, suffixes=("", "_floor"))
    assert np.all(both["sd_log"] >= both["sd_log_floor"])
    np.testing.assert_allclose(table["fold"], np.exp(2.0 * 1.6448536 * table["sd_log"]), rtol=1e-6)


def test_chosen_phases_serve_the_parameters_better_than_even_ones() -> None:
    placement = _found().placement
    gain = np.log(placement.sd_log[:, :3] / placement.sd_log_even[:, :3])
    assert gain.mean() < -0.05
