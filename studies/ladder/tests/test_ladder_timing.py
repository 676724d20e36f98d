"""Physiological timing: distances from ranges, the search, and what the shipped setting of it reaches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from forward_model_cases import COHORT, SETTINGS
from ladder_case import LADDER
from speed_case import ROOT

from studies.ladder.timing import (
    FAILED,
    RANGES,
    SEARCHED,
    TimingSearch,
    distance,
    moved_nuisances,
    reached,
    rounded,
    search_timing,
    searched_of,
    timing_loss,
    timing_table,
    with_searched,
)
from swesbi.config.read import read_merged
from swesbi.config.study import load_study
from swesbi.heart.settings import ForwardModelSettings

CENTRE = np.array([45.0, 5.0, 30.0])
SMALL = TimingSearch(seeds=(1,), population_size=6, generations=3)
OUTSIDE = {"ivct_ms", "lvet_ms", "ivrt_ms", "dpdt_mmhg_s"}


def configured() -> ForwardModelSettings:
    raw = read_merged(ROOT / "config.yaml") | {"cohort": str(ROOT / "data" / "virtual_volunteers")}
    study = load_study(raw)
    changes = LADDER.structures["physiological_timing"].changes
    return study.with_changes(changes, "test").config.forward_model


def test_a_distance_is_in_widths_of_the_range_and_counts_what_is_not_there() -> None:
    values = np.array([40.0, 60.0, 80.0, 20.0, 100.0, np.nan, 1e6])
    np.testing.assert_allclose(distance(values, (40.0, 80.0)), [0.0, 0.0, 0.0, 0.5, 0.5, FAILED, FAILED])
    np.testing.assert_allclose(distance(values[:2], (40.0, 80.0), margin=0.1), [0.1, 0.0])


def test_what_is_searched_is_set_and_read_back() -> None:
    u = np.linspace(0.1, 0.9, len(SEARCHED))
    made = with_searched(u, SETTINGS)
    np.testing.assert_allclose(searched_of(made), u)
    kept = {name for name in ForwardModelSettings.model_fields if name not in SEARCHED}
    assert all(getattr(made, name) == getattr(SETTINGS, name) for name in kept)
    low, high = SEARCHED["sigma_0_pa"]
    assert with_searched(np.zeros(len(SEARCHED)), SETTINGS).sigma_0_pa == low
    assert with_searched(np.ones(len(SEARCHED)), SETTINGS).sigma_0_pa == pytest.approx(high)
    assert rounded(made).sigma_0_pa == float(f"{made.sigma_0_pa:.3g}")


def test_the_shipped_setting_is_late_and_brief_and_its_pressure_rises_slowly() -> None:
    frame = timing_table(CENTRE, [COHORT["A"]], SETTINGS).set_index("quantity")
    assert set(frame.index[frame["inside"] == 0]) >= OUTSIDE
    ivct = frame.loc["ivct_ms"]
    assert ivct["largest_miss"] == pytest.approx(ivct["largest"] - 80.0)
    assert ivct["outside"] == "A"


def test_pressures_are_those_at_the_root_of_the_aorta() -> None:
    found = reached(CENTRE, [COHORT["A"]], SETTINGS)
    none = reached(CENTRE, [COHORT["A"]], SETTINGS.model_copy(update={"proximal_resistance_pa_s_m3": 1e5}))
    assert found["systolic_mmhg"][0] > none["systolic_mmhg"][0] + 5.0  # the drop over R_p is felt at the root
    assert set(found) == set(RANGES)


def test_a_heart_without_a_beat_has_nothing() -> None:
    broken = SETTINGS.model_copy(update={"maximum_beats": 2, "extrapolation_memory": 0})
    assert all(np.isnan(values).all() for values in reached(CENTRE, [COHORT["A"]], broken).values())
    assert timing_loss(CENTRE, [COHORT["A"]], broken) == pytest.approx(FAILED**2 * len(RANGES))


def test_a_search_comes_nearer_and_repeats_itself() -> None:
    contexts = [COHORT["B"]]
    fit, again = (search_timing(CENTRE, contexts, SETTINGS, SMALL) for _ in range(2))
    assert fit.settings == again.settings
    assert fit.loss < timing_loss(CENTRE, contexts, SETTINGS)
    assert fit.simulations == 18
    other = search_timing(CENTRE, contexts, SETTINGS, replace(SMALL, seeds=(2,)))
    assert other.settings != fit.settings


def test_the_setting_of_the_ladder_keeps_time_in_the_cohort() -> None:
    """What it is for: nearer to every range than the shipped setting, in the contexts of A to F."""
    found, shipped = (timing_table(CENTRE, list(COHORT.values()), s) for s in (configured(), SETTINGS))
    for name in OUTSIDE:
        ours, theirs = (frame.set_index("quantity").loc[name] for frame in (found, shipped))
        assert ours["largest_miss"] < 0.5 * theirs["largest_miss"], name
        assert ours["inside"] > theirs["inside"], name


def test_the_nuisance_parameters_move_with_the_setting() -> None:
    study = load_study(
        read_merged(ROOT / "config.yaml") | {"cohort": str(ROOT / "data" / "virtual_volunteers")}
    )
    changes = LADDER.structures["physiological_timing"].changes
    changed = study.with_changes(changes, "test").config
    moved = moved_nuisances(changed.forward_model, study.config.priors["calibrated"].nuisances)
    assert "passive_wall_factor" not in moved
    for name, own in moved.items():
        prior = getattr(changed.priors["calibrated"].nuisances, name)
        assert {"centre": prior.centre, "low": prior.low, "high": prior.high} == own
