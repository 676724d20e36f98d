"""The table and figure of published values, on made-up hearts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import speed_case
from figure_text import assert_text_apart

from studies.validation.published import (
    PRESSURE_DECAY,
    STIFFNESS_DECAY,
    Simulated,
    decay_ms,
    published_table,
    quantities_of_draws,
    values_of,
)
from studies.validation.published_figure import bars_of, draw_published
from studies.validation.published_values import (
    ADULTS,
    DECAY_R,
    DECAY_SLOPE,
    LATE_SHEAR,
    LATE_SPEED,
    LATE_YOUNG,
    OVER_HEARTS,
    PUBLISHED,
    QUANTITIES,
    RATIO,
)
from swesbi.base.arrays import FloatArray
from swesbi.heart.simulate import Beats


def hearts(ages: list[float], draws: int = 20) -> pd.DataFrame:
    """Made-up hearts of these ages; their decays of stiffness are twice those of pressure."""
    rng = np.random.default_rng(5)
    rows = len(ages) * draws
    single = {
        quantity.name: rng.lognormal(1.0, 0.3, rows) for quantity in QUANTITIES if quantity not in OVER_HEARTS
    }
    pressure = rng.lognormal(3.0, 0.2, rows)
    return pd.DataFrame(
        {
            "subject": np.repeat([f"H{number}" for number in range(len(ages))], draws),
            "age_years": np.repeat(ages, draws),
            "draw": np.tile(np.arange(draws), len(ages)),
            **single,
            PRESSURE_DECAY: pressure,
            STIFFNESS_DECAY: 2.0 * pressure + 5.0,
        }
    )


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    old = hearts([12.0, 25.0, 35.0, 45.0, 55.0, 65.0, 75.0])
    return published_table(Simulated(old, hearts([21.0, 24.0, 27.0]), hearts([21.0, 24.0, 27.0], draws=1)))


def test_each_published_value_has_a_row_with_its_source(table: pd.DataFrame) -> None:
    assert list(table["source"]) == [value.source for value in PUBLISHED]
    assert set(table["quantity"]) == {quantity.name for quantity in QUANTITIES}
    middle = table["published_mean"].fillna(table["published_low"])
    assert ((table["published_low"] <= middle) & (middle <= table["published_high"])).all()


def test_points_ascend_and_agreement_is_overlap_with_the_prior(table: pd.DataFrame) -> None:
    for name in ("prior", "posterior"):
        found = table[[f"{name}_5", f"{name}_50", f"{name}_95"]].dropna().to_numpy()
        assert len(found)
        assert (np.diff(found, axis=1) >= 0.0).all()
    apart = (table["published_high"] < table["prior_5"]) | (table["published_low"] > table["prior_95"])
    assert list(table["agrees"]) == ["no" if one else "yes" for one in apart]
    assert {"yes", "no"} == set(table["agrees"])


def test_ages_without_volunteers_have_none(table: pd.DataFrame) -> None:
    older = table[table["ages_from"] >= 40.0]
    assert len(older) == 5
    assert older[["posterior_50", "volunteers_low"]].isna().all(axis=None)
    assert set(older["volunteers_agree"]) == {""}
    assert older["prior_50"].notna().all()


def test_slope_and_correlation_are_over_hearts_once_a_draw() -> None:
    made = hearts([30.0, 40.0, 50.0], draws=7)
    assert values_of(made, DECAY_SLOPE, ADULTS) == pytest.approx(np.full(7, 2.0))
    assert values_of(made, DECAY_R, ADULTS) == pytest.approx(np.ones(7))
    assert not len(values_of(made, DECAY_SLOPE, (45.0, 60.0)))


def test_an_exponential_from_the_end_of_ejection_has_its_time_constant() -> None:
    phase = np.linspace(0.0, 1.0, 400, endpoint=False)
    fall = 4.0 + 36.0 * np.exp(-np.maximum(phase - 0.4, 0.0) / 0.05)
    rise = np.where(phase < 0.1, 4.0, fall)
    flow = np.where((phase > 0.15) & (phase < 0.401), 300.0, 0.0)
    curves = np.stack([rise, rise, np.full(400, np.nan)])
    flows = np.stack([flow, np.zeros(400), np.full(400, np.nan)])
    found = decay_ms(made_beats(phase, flows), curves, period_s=0.8)
    assert found[0] == pytest.approx(40.0, abs=2.0)
    assert np.isnan(found[1:]).all()


def made_beats(phase: FloatArray, flow: FloatArray) -> Beats:
    status = np.zeros(len(flow), np.int8)
    return Beats(phase, flow, flow, flow, flow, flow, flow, flow, status, status.astype(np.int64))


def test_quantities_of_a_simulated_heart_fit_together() -> None:
    model = speed_case.model()
    phi = speed_case.central_phi(model)[None]
    found = quantities_of_draws(model.settings, model.recording.context, phi).iloc[0]
    e, density = found[LATE_YOUNG.name], model.settings.density_kg_m3
    assert found[LATE_SHEAR.name] == pytest.approx(1e-3 * density * found[LATE_SPEED.name] ** 2)
    assert found[RATIO.name] * e == pytest.approx(3e-3 * density * found["peak_speed_m_s"] ** 2)
    assert found[RATIO.name] > 1.0
    assert found[[PRESSURE_DECAY, STIFFNESS_DECAY]].gt(0.0).all()
    context = replace(model.recording.context, age_years=70.0)
    older = quantities_of_draws(model.settings, context, phi).iloc[0]
    assert older[LATE_YOUNG.name] == e  # the model knows of no age


def test_text_of_the_figure_is_apart_and_bars_are_of_the_rows(table: pd.DataFrame) -> None:
    bars = bars_of(table[table["quantity"] == LATE_YOUNG.name])
    assert [bar.label for bar in bars].count("prior") == 3
    assert [bar.label for bar in bars].count("virtual volunteers") == 1
    assert_text_apart(draw_published(table))
