"""What pressures add, as a table: intervals, widths and shifts of draws whose quantiles are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import speed_case
from numpy.typing import NDArray
from posterior_case import exact_of
from recordings import RECORDING, make_samples

from swesbi.artefacts import ArtefactError
from swesbi.artefacts.typed import ByPlace, Place
from swesbi.checks.pressures import COLUMNS, PosteriorPair, pressures_table, pressures_table_of, quantities
from swesbi.heart.physiology import CAPACITANCE, TIME_CONSTANT, VOLUME_FACTOR
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.parameters import PEAK_ACTIVE
from swesbi.posterior.result import ExactPosterior
from swesbi.prior import log_centre
from swesbi.recording.cohort.clinical import ClinicalMeasures
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import Observation
from swesbi.report.figures.pressures import draw_pressures

MODEL: SpeedModelSettings = speed_case.settings("calibrated")
RESISTANCE = "distal_resistance_pa_s_m3"


def draws(model: SpeedModelSettings, widths: dict[str, float], shift: float = 0.0) -> NDArray[np.float64]:
    """Return 201 draws: log-linear about the prior's centre, of these half-widths, all in the same order."""
    centre, levels = log_centre(model.prior), np.linspace(-1.0, 1.0, 201)
    half = np.array([widths.get(name, 0.02) for name in model.prior.names])
    moved = np.array([shift if name == RESISTANCE else 0.0 for name in model.prior.names])
    return np.asarray(centre * np.exp(moved + levels[:, None] * half))


def result(phi: NDArray[np.float64]) -> ExactPosterior:
    return exact_of(phi)


def observation() -> Observation:
    samples = make_samples(speed_case.model().recording.speed_m_s, repeat_sd=0.04, sample_sd=0.08)
    return ingest(samples, speed_case.CONTEXT, RECORDING, 100, ClinicalMeasures(126.0, 83.0))


def compared() -> PosteriorPair:
    return PosteriorPair(
        experiment="amortised",
        observation=observation(),
        model=MODEL,
        without=result(draws(MODEL, {RESISTANCE: 0.4})),
        with_them=result(draws(MODEL, {RESISTANCE: 0.2}, shift=0.1)),
    )


def test_widths_and_shifts_are_logarithms_in_widths_of_the_interval_without() -> None:
    table = pressures_table_of([compared()])
    assert tuple(table.columns) == COLUMNS
    row = table[table["quantity"] == RESISTANCE].iloc[0]
    assert row["without_median"] == pytest.approx(1.5e8)
    assert row["with_median"] == pytest.approx(1.5e8 * np.exp(0.1))
    assert row["without_high"] == pytest.approx(1.5e8 * np.exp(0.36))
    assert row["width_ratio"] == pytest.approx(0.5)
    assert row["shift_in_widths"] == pytest.approx(0.1 / 0.72)
    assert (row["sbp_mmhg"], row["dbp_mmhg"], row["sampler"]) == (126.0, 83.0, "importance")


def test_every_parameter_is_compared_and_the_stressed_volume_like_all_others() -> None:
    narrower = replace(compared(), with_them=result(draws(MODEL, {VOLUME_FACTOR: 0.005})))
    table = pressures_table_of([narrower]).set_index("quantity")
    assert set(MODEL.prior.names) <= set(table.index)
    assert table.loc[VOLUME_FACTOR, "width_ratio"] == pytest.approx(0.25)
    assert table[["without_median", "width_ratio", "shift_in_widths"]].notna().all(axis=None)


def test_compliance_and_attained_stiffness_follow_from_the_draws() -> None:
    one = compared()
    found = quantities(MODEL, one.without.phi, one)
    np.testing.assert_allclose(found[CAPACITANCE], found[TIME_CONSTANT] / found[RESISTANCE])
    assert len(found[PEAK_ACTIVE.name]) == 201
    assert (found[PEAK_ACTIVE.name] < one.without.phi[:, 0]).all() and (found[PEAK_ACTIVE.name] > 5.0).all()
    assert list(found)[1:5] == ["k0_kpa", "k_atp_per_s", "k_sr_per_s", "passive_stiffness_kpa"]


def test_a_missing_posterior_is_named() -> None:
    one = compared()
    with pytest.raises(ArtefactError, match="posteriors: no file of subject T in experiment 'amortised'"):
        pressures_table(
            {"T": one.observation},
            ByPlace("posteriors", (), ExactPosterior.joined),
            {Place("amortised", "T"): one.with_them},
            population_models={"amortised": one.model},
        )


def test_a_row_is_told_by_experiment_and_subject() -> None:
    one, place = compared(), Place("amortised", "T")
    table = pressures_table(
        {"T": one.observation},
        {place: one.without},
        {place: one.with_them},
        population_models={"amortised": one.model},
    )
    pd.testing.assert_frame_equal(table, pressures_table_of([one]))


def test_the_figure_is_of_one_experiment() -> None:
    table = pressures_table_of([compared()])
    shown = draw_pressures(table, experiment="amortised", cohort_title="virtual volunteers")
    assert len(shown.axes) == 8
    with pytest.raises(ArtefactError, match="table: holds no other"):
        draw_pressures(table, experiment="other", cohort_title="virtual volunteers")
