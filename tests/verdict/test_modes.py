from __future__ import annotations

import numpy as np
import pytest

from swesbi.verdict.recording import two_modes


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
def test_two_modes_are_found_with_their_places(share: float) -> None:
    rng = np.random.default_rng(1)
    of_first = rng.random(2000) < share
    values = np.where(of_first, 20.0, 30.0) + 2.0 * rng.standard_normal(2000)
    assert two_modes(values) == pytest.approx((20.0, 30.0), abs=0.8)


def test_one_mode_is_one_whatever_its_shape_and_the_draws() -> None:
    """Of 300 posteriors with one mode, normal, skewed or flat, one in a hundred at most has two by chance."""
    rng = np.random.default_rng(2)
    shapes = (rng.standard_normal, lambda n: np.exp(0.6 * rng.standard_normal(n)), rng.random)
    found = [two_modes(shapes[number % 3](1000)) for number in range(300)]
    assert sum(modes is not None for modes in found) <= 3


def test_repeated_draws_far_out_and_failed_beats_are_no_mode() -> None:
    rng = np.random.default_rng(3)
    values = np.concatenate([rng.standard_normal(1000), np.full(30, 9.0), np.full(200, np.nan)])
    assert two_modes(values) is None
    assert two_modes(np.full(100, 3.0)) is None
    assert two_modes(np.empty(0)) is None


def test_where_the_density_vanishes_on_one_side_there_is_no_valley() -> None:
    """Kernels as narrow as a peak leave nothing of draws that lie apart."""
    values = np.concatenate([np.linspace(-1.1, -1.0, 100), 1e-7 * np.linspace(0.0, 1.0, 900)])
    with np.errstate(all="raise", under="ignore"):
        assert two_modes(values) is None
