"""The real model of speeds, exact weights from a small flow: right, and broken on purpose."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import exact_case
import flow_case
import numpy as np
import pandas as pd
import pytest
import speed_case
from calibration_case import checks_of, flagged
from numpy.typing import NDArray
from scipy.special import softmax

from swesbi.base.arrays import below_each_other
from swesbi.checks.calibration import local
from swesbi.checks.calibration.local import variance_given_first
from swesbi.checks.calibration.ranks import (
    QUANTITY_NAMES,
    prior_variance,
    quantities,
    rank,
    reference_points,
)
from swesbi.checks.calibration.table import COVERAGE, LOCAL, SBC, TARP
from swesbi.networks.flow.flow import flow_proposal
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.population.synthetic import own_recordings
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.importance import resample

FloatArray = NDArray[np.float64]
OF_SIZES = pytest.mark.parametrize(
    "recordings",
    [pytest.param(100, marks=pytest.mark.slow(minutes=0.2)), pytest.param(400, marks=pytest.mark.exhaustive)],
)
DRAWS = 600
PARAMETERS = QUANTITY_NAMES[:4]


def flow() -> TrainedFlow:
    return flow_case.trained(count=5000, epochs=30).estimator


@cache
def checks(count: int, times_used: int) -> pd.DataFrame:
    """The checks of recordings whose data are used so many times."""
    model, scores = speed_case.model(), []
    made = own_recordings(model, count, 3, "test")
    references = reference_points(count, model.settings.prior, np.random.default_rng(4))
    for index, recording in enumerate(made.recordings):
        of = replace(model, recording=recording)
        drawn = exact_case.weigh(HeartModel(of), flow_proposal(flow(), recording), DRAWS, 0.1, index)
        weight = softmax(drawn.log_weight + (times_used - 1) * drawn.log_likelihood)
        truth = made.phi[index][None]
        known = quantities(truth, of.log_likelihood(truth), of.activation_duration_s(truth))[0]
        values = quantities(drawn.phi, drawn.log_likelihood, of.activation_duration_s(drawn.phi))
        scores.append(rank(known, values, weight, references[index], model.settings.prior))
    return checks_of(below_each_other(scores), np.tile(prior_variance(model), (count, 1)))


@OF_SIZES
def test_the_exact_posterior_passes(recordings: int) -> None:
    found = checks(recordings, times_used=1)
    assert flagged(found) == set()
    covered = found[found["test"] == SBC].set_index("quantity")["coverage_90"]
    three_sd = 3.0 * np.sqrt(0.9 * 0.1 / recordings)
    for name in PARAMETERS:
        assert covered[name] == pytest.approx(0.9, abs=three_sd)


@OF_SIZES
def test_a_posterior_too_narrow_is_caught(recordings: int) -> None:
    found = checks(recordings, times_used=2)
    assert flagged(found, COVERAGE)
    joint = found[found["test"] == TARP].iloc[0]
    # of 100 its p-value lies about .05, and processors fall on either side
    assert joint.flagged or (recordings == 100 and joint.p_value <= 0.1)
    of_parameters = (found["test"] == SBC) & found["quantity"].isin(PARAMETERS)
    assert found.loc[of_parameters, "coverage_90"].max() < 0.88


@pytest.mark.parametrize(
    ("count", "width"),
    [
        pytest.param(60, 1.0, marks=pytest.mark.slow(minutes=0.3)),
        pytest.param(60, 2.0, marks=pytest.mark.slow(minutes=0.3)),
        pytest.param(150, 1.0, marks=pytest.mark.exhaustive),
        pytest.param(150, 1.5, marks=pytest.mark.exhaustive),
    ],
)
def test_local_calibration_passes_the_exact_posterior_and_catches_one_too_wide(
    count: int, width: float
) -> None:
    """Posterior SBC of the exact posterior, and of one wider in log phi; 60 draws do not always see 1.5."""
    model = speed_case.model()
    weighted = exact_case.weigh(HeartModel(model), flow_proposal(flow(), model.recording), 20_000, 0.1, 5)
    phi = resample(weighted, 4 * count, np.random.default_rng(6))
    centre = np.exp(np.log(phi).mean(axis=0))
    judged = np.clip(centre * (phi / centre) ** width, phi.min(axis=0), phi.max(axis=0))
    given = (model, flow(), exact_case.SETTINGS, DRAWS)
    _, scores = local.local_scores(*given, judged[:count], judged[count : 2 * count], 7, "test")
    variance = np.tile(variance_given_first(model, phi), (count, 1))
    assert bool(flagged(checks_of(scores, variance, kind=LOCAL))) == (width > 1.0)
