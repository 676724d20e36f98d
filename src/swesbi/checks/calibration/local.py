"""Calibration at one subject's own data: draws ranked given a second recording, samplers told apart.

Säilynoja, Schmitt, Bürkner and Vehtari (2025), Posterior SBC: simulation-based calibration checking
conditional on data. If phi is drawn from the posterior given the subject's recording and a second recording
is simulated from it, phi is a draw from the posterior given both. Its rank there is uniform where the first
draw was right, whatever holds elsewhere under the prior. The posterior given both is exact and new for each
second recording, so that neither sampler is judged by itself.

Whether network, weighted draws and long Markov chains draw from one distribution, a classifier says.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from swesbi.artefacts import UnfitError
from swesbi.artefacts.csv import PlainTable
from swesbi.artefacts.typed import BySubject
from swesbi.base.arrays import FloatArray, below_each_other
from swesbi.base.progress import Progress
from swesbi.checks.calibration.dataset import CalibrationLocal, TwoSamples
from swesbi.checks.calibration.ranks import (
    LOG_LIKELIHOOD,
    NETWORK,
    QUANTITY_NAMES,
    WEIGHTED,
    RankedRecordings,
    RankScores,
    quantities,
    quantity_names,
    rank,
    standardised,
)
from swesbi.checks.settings import LocalSettings
from swesbi.measurement.likelihood import (
    SpeedModel,
    SpeedModelSettings,
    draw_speeds,
    log_likelihood,
    residuals,
    speed_model,
)
from swesbi.measurement.shared_error import CellErrors, Errors
from swesbi.measurement.speeds import PredictedSpeeds, SpeedRecording
from swesbi.networks.flow.trained import TrainedFlow, flow_proposal
from swesbi.posterior.exact import weighted_posterior
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.mcmc import sample_mcmc, starting_points
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.settings import ExactSettings
from swesbi.posterior.space import Space
from swesbi.prior import BoxPrior, JointPriorSettings, to_logit
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
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


@dataclass(frozen=True)
class TwoRecordings(SpeedModel):
    """The model of two independent recordings of one subject at the same phases.

    ``recording`` has the mean log speeds of both; its posterior is wider than that of both.
    """

    both: tuple[SpeedRecording, SpeedRecording]

    @classmethod
    def of(cls, first: SpeedModel, speed_m_s: FloatArray) -> TwoRecordings:
        """Put the speeds (p,) of a second recording beside a first one."""
        one = first.recording
        mean = replace(one, speed_m_s=np.sqrt(one.speed_m_s * speed_m_s))
        return cls(mean, first.settings, (one, replace(one, speed_m_s=speed_m_s)))

    def log_likelihood_of(self, predicted: PredictedSpeeds) -> FloatArray:
        """Return log p(both recordings | phi) of n predictions, (n,); -inf where the simulation failed."""
        first, second = (log_likelihood(predicted, each, self.settings.discrepancy) for each in self.both)
        return first + second

    def standardised_of(self, predicted: PredictedSpeeds) -> FloatArray:
        """Return residuals of both at the measured phases; (n, 2 p)."""
        return np.hstack([residuals(predicted, each, self.settings.discrepancy) for each in self.both])

    def errors_of(self, predicted: PredictedSpeeds) -> Errors | CellErrors:
        """Return the errors of the mean log speeds of both about n predictions; NaN: failed."""
        return super().errors_of(predicted).times(np.sqrt(0.5))


def local_scores(
    model: SpeedModel,
    flow: TrainedFlow,
    exact: ExactSettings,
    effective_draws: int,
    phi: FloatArray,
    references: FloatArray,
    seed: int,
    sampler: str,
) -> tuple[FloatArray, RankScores]:
    """Simulate a second recording from each draw and rank the draw in the posterior given both.

    The draws ``phi`` (r, d) are a sampler's, given the subject's recording. Joint coverage is taken about the
    ``references`` (r, d), other draws of that posterior. The network proposes for the mean of both
    recordings. Random streams are the same for all samplers. True quantities (r, q) stand before their
    scores.
    """
    recording, prior = model.recording, model.settings.prior
    rng = generator(seed, "calibration", "local", "speeds", recording.subject)
    speeds = draw_speeds(model.predict(phi), recording.errors, model.settings.discrepancy, rng)
    points = standardised(references, prior)
    progress = Progress(f"calibration {recording.subject} (local, {sampler})", len(phi), unit="replicate")
    truths, scores = [], []
    for index, second in enumerate(speeds):
        both, true = TwoRecordings.of(model, second), phi[index][None]
        stream = integer_seed(seed, "calibration", "local", "exact", recording.subject, index)
        proposal = flow_proposal(flow, both.recording)
        drawn, _ = weighted_posterior(HeartModel(both), proposal, effective_draws, exact, stream)
        truth = quantities(true, both.log_likelihood(true), model.activation_duration_s(true))
        values = quantities(drawn.phi, drawn.log_likelihood, model.activation_duration_s(drawn.phi))
        scores.append(rank(truth[0], values, drawn.weight, points[index], prior))
        truths.append(truth)
        progress.step()
    return np.concatenate(truths), below_each_other(scores)


def variance_given_first(model: SpeedModel, phi: FloatArray) -> FloatArray:
    """Return the variance of each quantity under draws (n, d) given the first recording alone; (d + 2,).

    It takes the place of the prior's variance beside local calibration; the log-likelihood has none (NaN).
    """
    values = quantities(phi, np.zeros(len(phi)), model.activation_duration_s(phi))
    variance: FloatArray = values.var(axis=0)
    variance[QUANTITY_NAMES.index(LOG_LIKELIHOOD)] = np.nan
    return variance


def calibration_at_subject(
    observation: Observation,
    noise: CohortNoise,
    estimator: TrainedFlow,
    posterior: ExactPosterior,
    *,
    model: SpeedModelSettings,
    exact: ExactSettings,
    local: LocalSettings,
    with_chains: bool,
    seed: int,
) -> CalibrationLocal:
    """Rank draws of the subject's posterior given a second recording, and compare samplers pair by pair.

    The truths that are kept are draws of the reported posterior, and the prior variance is its variance.

    Raises:
        UnfitError: The posterior holds too few draws.
    """
    count = local.replicates
    least = max(2 * count, local.two_sample_draws)
    if min(len(posterior.phi), len(posterior.proposal_phi)) < least:
        raise UnfitError(
            "posterior",
            f"holds {len(posterior.phi)} draws and {len(posterior.proposal_phi)} of the network, calibration "
            f"takes {least}; raise exact.draws, or lower calibration.local.replicates or two_sample_draws",
        )
    recorded = speed_model(observation, noise, model)
    given = (recorded, estimator, exact, local.effective_draws)
    _, network = local_scores(*given, *_halves(posterior.proposal_phi, count), seed, NETWORK)
    truth, weighted = local_scores(*given, *_halves(posterior.phi, count), seed, WEIGHTED)
    ranked = RankedRecordings(
        names=quantity_names(recorded.settings.prior),
        subject=np.full(count, observation.subject),
        truth=truth,
        prior_variance=np.tile(variance_given_first(recorded, posterior.phi), (count, 1)),
        network=network,
        weighted=weighted,
    )
    proposal = flow_proposal(estimator, recorded.recording) if with_chains else None
    return CalibrationLocal(ranked, compare_samplers(recorded, posterior, proposal, local, seed))


def _halves(phi: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return the first draws, which are ranked, and as many others, about which coverage is taken."""
    return phi[:count], phi[count : 2 * count]
