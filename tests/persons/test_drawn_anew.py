"""A subject drawn anew under a narrower prior of theta: the posterior is normal and known."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import exact_case as case
import numpy as np
import pytest

from swesbi.base.settings import Settings
from swesbi.measurement.likelihood import SpeedModel
from swesbi.parameters import THETA_NAMES
from swesbi.persons.cohort.anew import drawn_anew
from swesbi.prior import JointPriorSettings, ParameterPrior, log_centre

NARROW = 0.15
FACTORS = np.array([1.4, 0.8, 1.2])


class NormalSettings(Settings):
    """What the model asks its settings for."""

    prior: JointPriorSettings


def test_draws_follow_the_likelihood_under_the_other_prior() -> None:
    theta = case.PRIOR.theta
    narrower = theta.model_copy(
        update={
            name: ParameterPrior(
                centre=before.centre * factor, log_sd=NARROW, low=before.low, high=before.high
            )
            for name, before, factor in zip(THETA_NAMES, theta.parameters, FACTORS, strict=True)
        }
    )
    stored = case.proposal().draw(20_000, 1)
    model = cast("SpeedModel", replace(case.ToyModel(), settings=NormalSettings(prior=case.PRIOR)))
    log_weight = np.full(len(stored), -np.log(len(stored)))
    anew = drawn_anew(model, (stored, log_weight), narrower, case.SETTINGS, 3)
    precision = case.MIXING.T @ (case.MIXING / case.NOISE_SD[:, None] ** 2)
    prior_precision = np.diag(np.r_[[1.0 / NARROW**2] * 3, 1.0 / case.LOG_SD**2])
    covariance = np.linalg.inv(precision + prior_precision)
    moved = np.r_[np.log(FACTORS), 0.0]
    mean = covariance @ (case.MIXING.T @ (case.OBSERVED / case.NOISE_SD**2) + prior_precision @ moved)
    expected = (np.log(log_centre(case.PRIOR)) + mean)[:3]
    sd = np.sqrt(np.diag(covariance))[:3]
    assert np.log(anew).mean(axis=0) == pytest.approx(expected, abs=float(4.5 * sd.max() / np.sqrt(2000)))
    assert np.log(anew).std(axis=0) == pytest.approx(sd, rel=0.1)
    before = np.log(stored).mean(axis=0)[:3]
    assert np.abs(before - expected).max() > 20.0 * sd.max() / np.sqrt(2000)
