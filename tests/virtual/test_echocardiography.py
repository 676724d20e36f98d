from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import speed_case

from swesbi.population.contexts import is_plausible
from swesbi.recording.speed import NoiseComponents
from swesbi.virtual.trial import noisier
from swesbi.virtual.volunteers import with_own_lvesv

CONFIG = speed_case.shipped()
CONTEXT = speed_case.CONTEXT
LVESV_FRACTION = speed_case.rule().volumes.lvesv_tolerance_fraction


def test_noisier_recordings_have_larger_errors_and_the_same_scale() -> None:
    own, noisy = CONFIG.acquisition, noisier(CONFIG.acquisition, 4.0 / 3.0)
    errors = (noisy.sample_sd_fraction, noisy.repeat_sd_fraction, noisy.sweep_fraction)
    assert errors == pytest.approx((0.08, 0.04, 0.02), rel=1e-12)
    assert noisy.scale_fraction == own.scale_fraction
    assert noisier(own, 1.0) == own
    assert NoiseComponents(0.03, 0.06, 0.015).times(4.0) == NoiseComponents(0.12, 0.24, 0.06)


def test_the_error_of_lvesv_has_the_sd_that_the_verdict_takes_it_to_have() -> None:
    rng = np.random.default_rng(4)
    listed = np.array([with_own_lvesv(CONTEXT, 0.4, LVESV_FRACTION, rng).lvesv_ml for _ in range(2000)])
    errors = np.log(listed / (0.4 * CONTEXT.lvedv_ml))
    assert errors.std() == pytest.approx(LVESV_FRACTION, rel=0.05)
    assert abs(errors.mean()) < 4.0 * LVESV_FRACTION / np.sqrt(2000)
    assert replace(with_own_lvesv(CONTEXT, 0.4, 0.0, rng), lvesv_ml=CONTEXT.lvesv_ml) == CONTEXT


def test_an_lvesv_that_ingestion_refuses_is_not_listed() -> None:
    rng = np.random.default_rng(5)
    weak = [with_own_lvesv(CONTEXT, 0.93, LVESV_FRACTION, rng) for _ in range(200)]
    assert max(one.lvesv_ml for one in weak) <= 0.97 * CONTEXT.lvedv_ml
    assert all(map(is_plausible, weak))
    with pytest.raises(RuntimeError, match=r"T: no LVESV .* of a heart that ejects 0\.010 of its blood"):
        with_own_lvesv(CONTEXT, 0.99, 0.001, rng)
