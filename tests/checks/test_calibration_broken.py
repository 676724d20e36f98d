"""The real model of speeds, exact weights from a small flow: right, and broken on purpose in three ways."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from types import MappingProxyType

import exact_case
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
    RankScores,
    prior_variance,
    quantities,
    rank,
    reference_points,
)
from swesbi.checks.calibration.table import CONTRACTION, COVERAGE, LOCAL, SBC, TARP
from swesbi.draws import equal_weights
from swesbi.heart.prior_simulations import draw_simulations
from swesbi.measurement.likelihood import SpeedModel
from swesbi.networks.flow.conditioning import ConditioningSettings
from swesbi.networks.flow.pool import at_phases
from swesbi.networks.flow.trained import TrainedFlow, flow_proposal
from swesbi.networks.flow.training import train_over_subjects
from swesbi.population.recordings import own_recordings
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.importance import resample
from swesbi.prior import draw_prior

FloatArray = NDArray[np.float64]
OF_SIZES = pytest.mark.parametrize(
    "recordings",
    [pytest.param(100, marks=pytest.mark.slow(minutes=0.2)), pytest.param(400, marks=pytest.mark.exhaustive)],
)
OF_LOCAL_SIZES = pytest.mark.parametrize(
    "count",
    [pytest.param(60, marks=pytest.mark.slow(minutes=0.2)), pytest.param(150, marks=pytest.mark.exhaustive)],
)
DRAWS = 600
PARAMETERS = QUANTITY_NAMES[:4]
RIGHT, NOISE_TOO_SMALL, PRIOR_RETURNED, DATA_TWICE = "right", "noise too small", "prior", "data twice"


@cache
def flow() -> TrainedFlow:
    experiment, model = speed_case.shipped().speed_experiments["calibrated"], speed_case.model()
    changes = {"transforms": 3, "hidden_features": 48, "hidden_layers": 2, "epochs": 25, "batch_size": 256}
    changes |= {"learning_rate": 2e-3}
    conditioning = ConditioningSettings(summary=experiment.summary, grid_points=100, density_kg_m3=1000.0)
    settings = model.settings
    drawn = draw_simulations(
        range(5000), model.recording.context, settings.prior.theta, settings.forward_model, 1
    )
    estimator = experiment.estimator.model_copy(update=changes)
    return train_over_subjects([at_phases(drawn, model)], conditioning, estimator, 2).estimator


def quieter(model: SpeedModel, factor: float) -> SpeedModel:
    """Return the model with every standard deviation multiplied."""
    discrepancy = model.settings.discrepancy
    scaled = discrepancy.model_copy(
        update={
            "speed_fraction": factor * discrepancy.speed_fraction,
            "timing_cycle": factor * discrepancy.timing_cycle,
        }
    )
    recording = replace(model.recording, relative_se=factor * model.recording.relative_se)
    return replace(
        model, recording=recording, settings=model.settings.model_copy(update={"discrepancy": scaled})
    )


@dataclass(frozen=True)
class Case:
    """One recording with its true phi and the draws of its proposal."""

    model: SpeedModel
    truth: FloatArray
    reference: FloatArray
    seed: int

    def scores(self) -> dict[str, RankScores]:
        model, proposal = self.model, flow_proposal(flow(), self.model.recording)
        weighted = exact_case.weigh(HeartModel(model), proposal, DRAWS, 0.1, self.seed)
        log_likelihood = weighted.log_likelihood
        small = quieter(model, 0.8).log_likelihood(weighted.phi)
        found = {
            RIGHT: self._score(weighted.phi, weighted.weight, log_likelihood),
            NOISE_TOO_SMALL: self._score(
                weighted.phi, softmax(weighted.log_weight + small - log_likelihood), log_likelihood
            ),
            DATA_TWICE: self._score(
                weighted.phi, softmax(weighted.log_weight + log_likelihood), log_likelihood
            ),
        }
        phi = draw_prior(model.settings.prior, 199, np.random.default_rng(self.seed))
        found[PRIOR_RETURNED] = self._score(phi, equal_weights(199), model.log_likelihood(phi))
        return found

    def _score(self, phi: FloatArray, weight: FloatArray, log_likelihood: FloatArray) -> RankScores:
        truth = self.truth[None]
        at_truth = self.model.activation_duration_s(truth)
        known = quantities(truth, self.model.log_likelihood(truth), at_truth)[0]
        values = quantities(phi, log_likelihood, self.model.activation_duration_s(phi))
        return rank(known, values, weight, self.reference, self.model.settings.prior)


@cache
def checks(count: int) -> Mapping[str, pd.DataFrame]:
    model = speed_case.model()
    made = own_recordings(model, count, 3, "test")
    references = reference_points(count, model.settings.prior, np.random.default_rng(4))
    scores = [
        Case(replace(model, recording=recording), made.phi[index], references[index], index).scores()
        for index, recording in enumerate(made.recordings)
    ]
    variance = np.tile(prior_variance(model), (count, 1))
    return MappingProxyType(
        {name: checks_of(below_each_other([one[name] for one in scores]), variance) for name in scores[0]}
    )


@OF_SIZES
def test_the_exact_posterior_passes(recordings: int) -> None:
    found = checks(recordings)[RIGHT]
    assert flagged(found) == set()
    covered = found[found["test"] == SBC].set_index("quantity")["coverage_90"]
    three_sd = 3.0 * np.sqrt(0.9 * 0.1 / recordings)
    for name in PARAMETERS:
        assert covered[name] == pytest.approx(0.9, abs=three_sd)


@pytest.mark.parametrize(
    ("broken", "recordings"),
    [
        pytest.param(DATA_TWICE, 100, marks=pytest.mark.slow(minutes=0.2)),
        pytest.param(DATA_TWICE, 400, marks=pytest.mark.exhaustive),
        pytest.param(NOISE_TOO_SMALL, 400, marks=pytest.mark.exhaustive),
    ],
)
def test_a_posterior_too_narrow_is_caught(broken: str, recordings: int) -> None:
    found = checks(recordings)[broken]
    assert flagged(found, COVERAGE)
    joint = found[found["test"] == TARP].iloc[0]
    # of 100 its p-value lies about .05, and processors fall on either side
    assert joint.flagged or (recordings == 100 and joint.p_value <= 0.1)
    of_parameters = (found["test"] == SBC) & found["quantity"].isin(PARAMETERS)
    assert found.loc[of_parameters, "coverage_90"].max() < 0.88


@OF_SIZES
def test_the_prior_returned_passes_ranks_of_parameters_but_not_contraction(recordings: int) -> None:
    found = checks(recordings)[PRIOR_RETURNED]
    assert not flagged(found, SBC, COVERAGE) & set(PARAMETERS)
    assert flagged(found, CONTRACTION) >= set(PARAMETERS)
    assert "log_likelihood" in flagged(found, SBC)


@cache
def local_scores(count: int, widened: bool) -> tuple[RankScores, FloatArray]:
    """Posterior SBC of the exact posterior, or of one that is half as wide again in log phi."""
    model = speed_case.model()
    proposal = flow_proposal(flow(), model.recording)
    weighted = exact_case.weigh(HeartModel(model), proposal, 20_000, 0.1, 5)
    phi = resample(weighted, 4 * count, np.random.default_rng(6))
    judged = phi[: 2 * count]
    if widened:
        centre = np.exp(np.log(phi).mean(axis=0))
        judged = np.clip(centre * (judged / centre) ** 1.5, phi.min(axis=0), phi.max(axis=0))
    given = (model, flow(), exact_case.SETTINGS, DRAWS)
    _, scores = local.local_scores(*given, judged[:count], judged[count:], 7, "test")
    return scores, np.tile(variance_given_first(model, phi), (count, 1))


@OF_LOCAL_SIZES
def test_local_calibration_passes_the_exact_posterior(count: int) -> None:
    assert flagged(checks_of(*local_scores(count, widened=False), kind=LOCAL)) == set()


@OF_LOCAL_SIZES
def test_local_calibration_catches_a_posterior_too_wide(count: int) -> None:
    assert flagged(checks_of(*local_scores(count, widened=True), kind=LOCAL)) != set()
