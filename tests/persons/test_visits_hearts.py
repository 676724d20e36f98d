"""The likelihood of the hearts of two visits: what measures them is integrated out of both together."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import speed_case
from scipy.special import logsumexp
from scipy.stats import multivariate_t, norm

from swesbi.base.arrays import FloatArray
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import SpeedRecording
from swesbi.persons.change.visits import VisitsModel, visits_model
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.marginal import Marginal
from swesbi.posterior.space import of_scores

INDEX = (np.delete(np.arange(20), [3]), np.delete(np.arange(20), [0, 9, 15]))
TIED = {"passive_stiffness_kpa": 0.5, "passive_ratio": 0.7, "speed_scale": 0.9, "destruction_alpha": 0.8}
DRAWS = 3000
ESTIMATES = 1000


@cache
def models() -> tuple[SpeedModel, SpeedModel]:
    """Recordings in sweeps, each without phases of its own; the later is faster, at another heart rate."""
    made, sweeps = speed_case.model(prior="calibrated"), speed_case.model_of_sweeps().recording

    def recorded(visit: int) -> SpeedRecording:
        index = INDEX[visit]
        return replace(
            made.recording,
            context=replace(made.recording.context, hr_bpm=66.0 + 4.0 * visit),
            phase=made.recording.phase[index],
            speed_m_s=made.recording.speed_m_s[index] * (1.0 + 0.04 * visit),
            relative_se=sweeps.relative_se[index],
            shared=sweeps.shared[index],
        )

    first, later = (replace(made, recording=recorded(visit)) for visit in (0, 1))
    return first, later


def both(shares: dict[str, float], discrepancy_share: float) -> VisitsModel:
    names = models()[0].settings.prior.names
    of_names = np.array([shares.get(name, 0.0) for name in names])
    return visits_model(models(), INDEX, of_names, discrepancy_share)


def hearts(n: int, seed: int) -> FloatArray:
    """Psi (n, 2 k) of hearts near the one that was recorded."""
    prior, rng = models()[0].settings.prior.simulated, np.random.default_rng(seed)

    def of_visit() -> FloatArray:
        near = of_scores(0.3 * rng.standard_normal((n, len(prior.parameters))), prior)
        near[:, :3] = speed_case.PHI[:3] * np.exp(0.1 * rng.standard_normal((n, 3)))
        return near

    return np.hstack([of_visit(), of_visit()])


def in_whole(model: VisitsModel, psi: FloatArray) -> FloatArray:
    """Return log p(both recordings | psi) of psi (n, 2 d), each simulated and measured in whole."""
    walls = [one.wall(phi) for one, phi in zip(model.models, model.coupling.phi(psi), strict=True)]
    return model.log_density_about(model.predicted(psi, walls))


def long_average(model: VisitsModel, heart: FloatArray) -> tuple[float, float]:
    """Return log p(both recordings | heart), of psi (2 k,), and its error, by weighted draws of the scores.

    Each has its own psi of all parameters, which is simulated and measured in whole.
    """
    walls, _ = model.simulated(heart[None])
    about = model.conditional(heart[None], walls)
    wide = multivariate_t(about.mode[0], about.root[0] @ about.root[0].T, df=8, seed=5)
    scores, prior = wide.rvs(DRAWS), models()[0].settings.prior
    psi = np.empty((DRAWS, model.number, len(prior.names)))
    measures = [j for j, name in enumerate(prior.names) if name not in prior.simulated.names]
    others = [j for j in range(len(prior.names)) if j not in measures]
    by_visit = scores.reshape(DRAWS, model.number, -1)
    for visit, own in enumerate(np.split(heart, model.number)):
        psi[:, visit, others] = own
        psi[:, visit, measures] = of_scores(by_visit[:, visit], prior.operator)
    log_likelihood = in_whole(model, psi.reshape(DRAWS, -1))
    log_ratio = log_likelihood + norm.logpdf(scores).sum(axis=1) - wide.logpdf(scores)
    weight = np.exp(log_ratio - logsumexp(log_ratio))
    return float(logsumexp(log_ratio) - np.log(DRAWS)), float(np.sqrt((weight**2).sum() - 1.0 / DRAWS))


def averaged(model: Marginal[Any], heart: FloatArray) -> tuple[float, float]:
    """Return the log of the mean estimate of hearts that hardly differ from one, (k,), and its error."""
    near = heart * np.exp(1e-7 * np.random.default_rng(4).standard_normal((ESTIMATES, len(heart))))
    estimate = model.log_likelihood(near)
    spread = np.exp(estimate - estimate.max()).std() / np.exp(estimate - estimate.max()).mean()
    return float(logsumexp(estimate) - np.log(ESTIMATES)), float(spread / np.sqrt(ESTIMATES))


def test_the_likelihood_of_both_hearts_is_a_long_average_over_what_measures_them() -> None:
    model = both(TIED, 0.6)
    for heart in hearts(2, seed=1):
        known, found = long_average(model, heart), averaged(model, heart)
        error = np.hypot(known[1], found[1])
        assert error < 0.03
        assert abs(found[0] - known[0]) < 4.0 * error
        assert abs(averaged(both({}, 0.0), heart)[0] - known[0]) > 0.5  # so the ties are seen


def test_visits_that_share_nothing_have_the_product_of_the_likelihoods_of_their_hearts() -> None:
    for heart in hearts(2, seed=2):
        together = averaged(both({}, 0.0), heart)
        parts = np.split(heart, 2)
        alone = [averaged(HeartModel(one), part) for one, part in zip(models(), parts, strict=True)]
        error = np.sqrt(together[1] ** 2 + sum(each[1] ** 2 for each in alone))
        assert error < 0.03
        assert abs(together[0] - sum(each[0] for each in alone)) < 4.0 * error


def test_psi_is_completed_about_the_hearts_and_has_their_likelihood() -> None:
    model, some = both(TIED, 0.6), hearts(5, seed=3)
    found = model.evaluated(some)
    np.testing.assert_array_equal(model.points(found.phi), some)
    np.testing.assert_allclose(found.log_likelihood_of_phi, in_whole(model, found.phi), rtol=1e-9)
