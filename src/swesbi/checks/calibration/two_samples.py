"""Whether a classifier can tell two samplers apart: network, weighted draws, long Markov chains."""

from __future__ import annotations

import logging
from typing import Final

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from swesbi.artefacts.csv import PlainTable
from swesbi.artefacts.typed import BySubject
from swesbi.base.arrays import FloatArray
from swesbi.checks.calibration.dataset import TwoSamples
from swesbi.checks.calibration.ranks import NETWORK, WEIGHTED
from swesbi.checks.settings import LocalSettings
from swesbi.measurement.likelihood import SpeedModel
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.mcmc import sample_mcmc, starting_points
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.space import Space
from swesbi.prior import BoxPrior, JointPriorSettings, to_logit
from swesbi.seeds import generator, integer_seed

LOGGER = logging.getLogger("swesbi")
LONG_CHAINS: Final = "mcmc"
FOLDS: Final = 5
FARTHEST_SD: Final = 6.0
RIDGE: Final = 0.05
"""Inverse of the penalty on the weights of the classifier, whose features are of variance one."""


def classifier_accuracy(first: FloatArray, second: FloatArray, prior: BoxPrior, seed: int) -> float:
    """Return the cross-validated accuracy of telling two equal samples (n, d) of phi apart.

    One half where the distributions are the same (Lopez-Paz and Oquab 2017), which needs samples of one size.
    The classifier is a logistic regression on the logits of phi and their products: the best one between
    normal distributions, which posteriors nearly are there. It sees differences in place, width and
    correlation, and hardly any other. NaN where a sample holds NaN: nothing was there to compare.
    """
    from sklearn.linear_model import LogisticRegression
    from sklearn.model_selection import StratifiedGroupKFold, cross_val_score
    from sklearn.preprocessing import PolynomialFeatures, StandardScaler

    if len(first) != len(second):
        raise ValueError(f"C2ST needs samples of one size, got {len(first)} and {len(second)} draws")
    if np.isnan(first).any() or np.isnan(second).any():
        return float("nan")
    eta = to_logit(np.concatenate([first, second]), prior)
    # far draws, of which there are few, would else decide by the squares of their distances
    standardised = np.clip((eta - eta.mean(axis=0)) / eta.std(axis=0), -FARTHEST_SD, FARTHEST_SD)
    features = StandardScaler().fit_transform(PolynomialFeatures(2).fit_transform(standardised))
    # a weighted draw that is taken twice would be recognised, were it in two folds
    copies = np.unique(eta, axis=0, return_inverse=True)[1]
    folds = StratifiedGroupKFold(FOLDS, shuffle=True, random_state=seed % 2**32)
    of_second = np.arange(len(eta)) >= len(first)
    with threadpool_limits(limits=1):  # sums split over threads differ in the last bit
        classifier = LogisticRegression(C=RIDGE, max_iter=1000)
        return float(cross_val_score(classifier, features, of_second, groups=copies, cv=folds).mean())


def compare_samplers(
    model: SpeedModel, exact: ExactPosterior, space: Space | None, sizes: LocalSettings, seed: int
) -> TwoSamples:
    """Return the accuracy of a classifier between the samplers of one subject, pair by pair.

    Long chains are among them where there is a ``space`` for these to move in.
    """
    prior, count, subject = model.settings.prior, sizes.two_sample_draws, model.recording.subject
    samples = {NETWORK: exact.proposal_phi[:count], WEIGHTED: exact.phi[:count]}
    pairs = [(NETWORK, WEIGHTED)]
    if space is not None:
        samples[LONG_CHAINS] = _long_chains(model, exact, space, sizes, seed)
        pairs = [(NETWORK, LONG_CHAINS), (WEIGHTED, LONG_CHAINS), *pairs]
    stream = integer_seed(seed, "calibration", "c2st", subject)
    accuracy = {
        f"{first} {second}": classifier_accuracy(samples[first], samples[second], prior, stream)
        for first, second in pairs
    }
    for pair, value in accuracy.items():
        LOGGER.info("%s, C2ST between %s: %.3f", subject, pair, value)
    values = np.array([[*accuracy.values()]])
    return TwoSamples((subject,), tuple(accuracy), values, np.full_like(values, count))


def _long_chains(
    model: SpeedModel, exact: ExactPosterior, space: Space, sizes: LocalSettings, seed: int
) -> FloatArray:
    """Return draws (n, d) of long chains; NaN where these did not converge, which compares with nothing."""
    count, subject = sizes.two_sample_draws, model.recording.subject
    rng = generator(seed, "calibration", "mcmc", subject)
    heart = HeartModel(model)
    start = starting_points(heart, exact.weighted, sizes.mcmc.start_points, rng)
    stream = integer_seed(seed, "calibration", "mcmc", subject)
    chains = sample_mcmc(heart, start, sizes.mcmc, stream, space=space)
    LOGGER.info(
        "%s: %d steps of MCMC, R-hat at most %.4f, %.0f effective draws",
        subject, chains.steps, chains.r_hat.max(), chains.effective_draws.min(),
    )  # fmt: skip
    if chains.converged:
        return heart.evaluated(chains.thinned(count, rng)).phi
    LOGGER.warning("%s: the long chains did not converge; raise calibration.local.mcmc.max_steps", subject)
    return np.full((count, exact.phi.shape[1]), np.nan)


def agreement_of_networks(
    posteriors: BySubject[ExactPosterior],
    base_posteriors: BySubject[ExactPosterior],
    *,
    joint_prior: JointPriorSettings,
    two_sample_draws: int,
    seed: int,
) -> PlainTable:
    """Let a classifier tell the draws for each subject from the exact ones of the base experiment.

    Its accuracy is that of the network's own draws ("proposal") and of the exact ones ("weighted").
    """
    rows = []
    for subject, result in posteriors.items():
        exact = base_posteriors[subject].phi[:two_sample_draws]
        for sampler, phi, name in ((NETWORK, result.proposal_phi, "npe"), (WEIGHTED, result.phi, WEIGHTED)):
            stream = integer_seed(seed, "population agreement", subject, name)
            accuracy = classifier_accuracy(phi[:two_sample_draws], exact, joint_prior, stream)
            rows.append({"subject": subject, "sampler": sampler, "draws": len(exact), "c2st": accuracy})
            LOGGER.info("subject %s, %s: C2ST %.3f", subject, sampler, accuracy)
    return pd.DataFrame(rows)
