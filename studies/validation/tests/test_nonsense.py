"""Curves that no heart makes: each change is what its name says, and wild values are wild alone."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from recordings import make_samples

from studies.validation.nonsense import CURVES, PHASE, SAMPLE, SPIKE, WILD, nonsense_table, with_wild

HEART = 10.0 + 40.0 * np.exp(-0.5 * ((PHASE - 0.2) / 0.06) ** 2)


def changed(name: str) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    return CURVES[name](HEART, np.random.default_rng(1))


def peak(name: str) -> float:
    return float(PHASE[np.argmax(changed(name))])


@pytest.mark.parametrize("name", CURVES)
def test_a_change_is_a_curve_of_positive_stiffness_and_another(name: str) -> None:
    curve = changed(name)
    assert curve.shape == PHASE.shape and (curve > 0.0).all()
    assert np.abs(curve - HEART).max() > 5.0


def test_changes_are_what_their_names_say() -> None:
    assert 0.5 < peak("late peak") < 0.6
    assert 0.78 < peak("trigger at the T wave") < 0.88
    assert peak("a quarter late") == pytest.approx(0.45, abs=0.01)
    assert peak("reversed") == pytest.approx(0.8, abs=0.01)
    assert changed("clipped at half").max() == pytest.approx(0.5 * (HEART.min() + HEART.max()))
    assert np.ptp(changed("flat")) == 0.0
    twice = changed("two peaks")
    assert np.abs(twice[:100] - twice[100:]).max() < 0.5
    assert np.log(changed("noise")).std() > 0.3


@pytest.mark.parametrize("wild", [SAMPLE, SPIKE])
def test_one_sample_or_all_of_a_phase_are_wild(wild: str) -> None:
    samples = make_samples()
    factor = with_wild(samples, wild, np.random.default_rng(2)).speed_m_s / samples.speed_m_s
    moved = factor != 1.0
    np.testing.assert_allclose(factor[moved], WILD)
    if wild == SAMPLE:
        assert moved.sum() == 1
    else:
        (phase,) = np.unique(samples.phase_index[moved])
        assert np.array_equal(moved, samples.phase_index == phase)


def test_the_table_counts_every_outcome() -> None:
    said = ("refused", "doubtful", "contradicted", "not contradicted")
    rows: list[dict[str, object]] = [{"change": "flat", "form": "gated", "status": word} for word in said]
    kept = {"change": SPIKE, "form": "pushes", "status": "not contradicted"}
    rows += [kept | {"named": True, "near": False}, kept | {"named": True, "near": True}]
    table = nonsense_table(pd.DataFrame(rows)).set_index("change")
    assert table.loc["flat", list(said)].tolist() == [1, 1, 1, 1]
    assert table.loc[SPIKE, ["not contradicted", "named", "near"]].tolist() == [2, 2, 1]
    assert np.isnan(table.loc["flat", "named"])
