"""What pressures add, as a table: intervals, widths and shifts of draws whose quantiles are known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import speed_case
from comparison_case import observation
from numpy.typing import NDArray
from posterior_case import exact_of

from swesbi.artefacts import ArtefactError
from swesbi.artefacts.typed import ByPlace, Place
from swesbi.checks.pressures import pressures_table, quantities
from swesbi.heart.physiology import CAPACITANCE, TIME_CONSTANT, VOLUME_FACTOR
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.parameters import PEAK_ACTIVE
from swesbi.posterior.result import ExactPosterior
from swesbi.prior import log_centre
from swesbi.recording.cohort.clinical import ClinicalMeasures

MODEL: SpeedModelSettings = speed_case.settings("calibrated")
RESISTANCE = "distal_resistance_pa_s_m3"


def draws(model: SpeedModelSettings, widths: dict[str, float], shift: float = 0.0) -> NDArray[np.float64]:
    """Return 201 draws: log-linear about the prior's centre, of these half-widths, all in the same order."""
    centre, levels = log_centre(model.prior), np.linspace(-1.0, 1.0, 201)
    half = np.array([widths.get(name, 0.02) for name in model.prior.names])
    moved = np.array([shift if name == RESISTANCE else 0.0 for name in model.prior.names])
    return np.asarray(centre * np.exp(moved + levels[:, None] * half))


PLACE = Place("amortised", "T")
WITHOUT = exact_of(draws(MODEL, {RESISTANCE: 0.4}))
WITH_THEM = exact_of(draws(MODEL, {RESISTANCE: 0.2}, shift=0.1))


def table_of(with_them: ExactPosterior, without: Mapping[Place, ExactPosterior]) -> pd.DataFrame:
    recorded = replace(observation("T"), clinical=ClinicalMeasures(126.0, 83.0))
    models = {PLACE.experiment: MODEL}
    return pressures_table({"T": recorded}, without, {PLACE: with_them}, population_models=models)


def test_widths_and_shifts_are_logarithms_in_widths_of_the_interval_without() -> None:
    row = table_of(WITH_THEM, {PLACE: WITHOUT}).set_index("quantity").loc[RESISTANCE]
    assert row["without_median"] == pytest.approx(1.5e8)
    assert row["with_median"] == pytest.approx(1.5e8 * np.exp(0.1))
    assert row["without_high"] == pytest.approx(1.5e8 * np.exp(0.36))
    assert row["width_ratio"] == pytest.approx(0.5)
    assert row["shift_in_widths"] == pytest.approx(0.1 / 0.72)
    assert (row["sbp_mmhg"], row["dbp_mmhg"], row["sampler"]) == (126.0, 83.0, "importance")


def test_every_parameter_is_compared_and_the_stressed_volume_like_all_others() -> None:
    narrower = exact_of(draws(MODEL, {VOLUME_FACTOR: 0.005}))
    table = table_of(narrower, {PLACE: WITHOUT}).set_index("quantity")
    assert set(MODEL.prior.names) <= set(table.index)
    assert table.loc[VOLUME_FACTOR, "width_ratio"] == pytest.approx(0.25)
    assert table[["without_median", "width_ratio", "shift_in_widths"]].notna().all(axis=None)


def test_compliance_and_attained_stiffness_follow_from_the_draws() -> None:
    found = quantities(MODEL, WITHOUT.phi, speed_case.CONTEXT)
    np.testing.assert_allclose(found[CAPACITANCE], found[TIME_CONSTANT] / found[RESISTANCE])
    assert (found[PEAK_ACTIVE.name] < WITHOUT.phi[:, 0]).all() and (found[PEAK_ACTIVE.name] > 5.0).all()


def test_a_missing_posterior_is_named() -> None:
    with pytest.raises(ArtefactError, match="posteriors: no file of subject T in experiment 'amortised'"):
        table_of(WITH_THEM, ByPlace("posteriors", (), ExactPosterior.joined))
