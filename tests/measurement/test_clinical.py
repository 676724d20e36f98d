from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import speed_case
from scipy.stats import norm

from swesbi.heart.beats import aortic_pressure_mmhg
from swesbi.measurement.clinical import ClinicalModel, log_pressure_density, with_pressures
from swesbi.posterior.hearts import HeartModel
from swesbi.prior import draw_prior
from swesbi.recording.cohort.clinical import ClinicalErrors, ClinicalMeasures

SETTINGS: ClinicalErrors = speed_case.shipped().clinical
CUFF = ClinicalMeasures(126.0, 83.0)
UNEVEN = ClinicalErrors(
    sbp_bias_mmhg=2.0, sbp_sd_mmhg=7.0, dbp_bias_mmhg=-3.0, dbp_sd_mmhg=4.0, lvet_sd_ms=10.0
)


def model(clinical: ClinicalMeasures = CUFF) -> ClinicalModel:
    return with_pressures(speed_case.model(prior="calibrated"), clinical, SETTINGS)


def test_each_pressure_is_normal_about_that_of_the_aorta_plus_its_bias() -> None:
    aortic = np.array([[80.0, 120.0, 100.0], [70.0, 90.0, 140.0], [np.nan] * 3])
    found = log_pressure_density(aortic, CUFF, UNEVEN)
    expected = norm.logpdf(126.0, [122.0, 142.0], 7.0) + norm.logpdf(83.0, [77.0, 67.0], 4.0)
    np.testing.assert_allclose(found, [*expected, -np.inf], rtol=1e-12)  # the last beat failed


def test_the_likelihood_is_that_of_the_speeds_times_that_of_the_pressures() -> None:
    made = model()
    phi = draw_prior(made.settings.prior, 60, np.random.default_rng(1))
    beats = made.simulate(phi)
    aortic = aortic_pressure_mmhg(beats, made.settings.forward_model)
    pressures = norm.logpdf(126.0 - 0.3, aortic.max(axis=1), 10.0)
    pressures += norm.logpdf(83.0 - 4.5, aortic.min(axis=1), 8.0)
    alone, both = HeartModel(made.speeds), HeartModel(made.speeds, made)
    hearts = alone.points(phi)
    found = both.log_likelihood(hearts)
    np.testing.assert_allclose(found, alone.log_likelihood(hearts) + pressures, rtol=1e-9)
    of_speeds = alone.evaluated(hearts)
    np.testing.assert_array_equal(both.evaluated(hearts).phi, of_speeds.phi)
    beside = HeartModel(made.speeds, made, informed=False).evaluated(hearts)
    np.testing.assert_array_equal(beside.log_likelihood, of_speeds.log_likelihood)
    np.testing.assert_array_equal(beside.informed().log_likelihood, found)
    assert np.ptp(pressures[np.isfinite(pressures)]) > 1.0


@pytest.mark.parametrize("clinical", [ClinicalMeasures(), ClinicalMeasures(lvet_ms=290.0)])
def test_without_pressures_there_is_no_such_model(clinical: ClinicalMeasures) -> None:
    with pytest.raises(ValueError, match="subject T: no pressures were measured; enter sbp_mmhg and dbp"):
        model(clinical)


def test_an_open_circulation_is_refused() -> None:
    alone = speed_case.model(prior="calibrated")
    forward = alone.settings.forward_model.model_copy(
        update={"circulation": "open", "atrial_pressure_pa": 1e3, "venous_pressure_pa": 1e3}
    )
    changed = replace(alone, settings=alone.settings.model_copy(update={"forward_model": forward}))
    with pytest.raises(ValueError, match="pressures need forward_model.circulation: closed"):
        with_pressures(changed, CUFF, SETTINGS)
