"""Calibration at one subject's own data, and whether a classifier can tell two samplers apart.

Säilynoja, Schmitt, Bürkner and Vehtari (2025), Posterior SBC: simulation-based calibration checking
conditional on data. If phi is drawn from the posterior given the subject's recording and a second recording
is simulated from it, phi is a draw from the posterior given both. Its rank there is uniform where the first
draw was right, whatever holds elsewhere under the prior. The posterior given both is exact and new for each
second recording, so that neither sampler is judged by itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np
from threadpoolctl import threadpool_limits

from swesbi.base.arrays import FloatArray, below_each_other
from swesbi.base.progress import Progress
from swesbi.checks.calibration import ranks
from swesbi.checks.calibration.settings import LocalSettings
from swesbi.measurement.instants import CellErrors
from swesbi.measurement.likelihood import (
    SpeedModel,
    SpeedModelSettings,
    draw_speeds,
    log_likelihood,
    residuals,
)
from swesbi.measurement.shared_error import Errors
from swesbi.measurement.speeds import PredictedSpeeds, SpeedRecording, WallPhases
from swesbi.networks.flow.flow import flow_proposal
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.posterior.exact import weighted_posterior
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.settings import ExactSettings
from swesbi.posterior.space import PlacedProposal
from swesbi.prior import BoxPrior, to_logit
from swesbi.seeds import generator, integer_seed

FOLDS: Final = 5
FARTHEST_SD: Final = 6.0
RIDGE: Final = 0.05
"""Inverse of the penalty on the weights of the classifier, whose features are of variance one."""


def classifier_accuracy(first: FloatArray, second: FloatArray, prior: BoxPrior, seed: int) -> float:
    """Return the cross-validated accuracy of telling two equal samples (n, d) of phi apart.

    One half where the distributions are the same (Lopez-Paz and Oquab 2017). The classifier is a logistic
    regression on the logits of phi and their products: the best one between normal distributions, which
    posteriors nearly are there. It sees differences in place, width and correlation, and hardly any other.
    NaN where a sample holds NaN: nothing was there to compare.

    Raises:
        ValueError: The samples differ in size, so that one half would not mean equality.
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


@dataclass(frozen=True)
class TwoRecordings:
    """The model of two independent recordings of one subject at the same phases."""

    first: SpeedModel
    second: SpeedRecording

    @property
    def settings(self) -> SpeedModelSettings:
        """The settings, which hold the prior."""
        return self.first.settings

    @property
    def recording(self) -> SpeedRecording:
        """The recording with the mean log speeds of both; its posterior is wider than that of both."""
        recording = self.first.recording
        return replace(recording, speed_m_s=np.sqrt(recording.speed_m_s * self.second.speed_m_s))

    def log_likelihood(self, phi: FloatArray) -> FloatArray:
        """Return log p(both recordings | phi) of shape (n,); -inf where the simulation failed."""
        return self.log_likelihood_of(self.first.predict(phi))

    def log_likelihood_of(self, predicted: PredictedSpeeds) -> FloatArray:
        """Return the same of predicted speeds."""
        of_second = log_likelihood(predicted, self.second, self.settings.discrepancy)
        return self.first.log_likelihood_of(predicted) + of_second

    def standardised_of(self, predicted: PredictedSpeeds) -> FloatArray:
        """Return residuals of both at the measured phases; (n, 2 p)."""
        both = (self.first.recording, self.second)
        return np.hstack([residuals(predicted, each, self.settings.discrepancy) for each in both])

    def errors_of(self, predicted: PredictedSpeeds) -> Errors | CellErrors:
        """Return the errors of the mean log speeds of both about n predictions; NaN: failed."""
        return self.first.errors_of(predicted).times(np.sqrt(0.5))

    def wall(self, phi: FloatArray) -> WallPhases:
        """Simulate phi (n, d) and return its wall at the measured phases; NaN where it failed."""
        return self.first.wall(phi)

    def predict_at(self, phi: FloatArray, wall: WallPhases) -> PredictedSpeeds:
        """Return the noiseless log speeds of phi (n, d) whose walls are given."""
        return self.first.predict_at(phi, wall)


def local_scores(
    model: SpeedModel,
    propose: Callable[[SpeedRecording], PlacedProposal],
    exact: ExactSettings,
    effective_draws: int,
    phi: FloatArray,
    references: FloatArray,
    seed: int,
    sampler: str,
) -> tuple[FloatArray, ranks.RankScores]:
    """Simulate a second recording from each draw and rank the draw in the posterior given both.

    Args:
        model: The subject's model.
        propose: Returns the proposal for a recording.
        exact: The study's own settings of the exact posterior.
        effective_draws: Effective draws given both recordings, at least.
        phi: Draws from a sampler's posterior given the subject's recording; shape (r, d).
        references: phi around which joint coverage is taken, other draws of that posterior; (r, d).
        seed: Seed of the study.
        sampler: The sampler's name, for progress; random streams are the same for all.

    Returns:
        True quantities (r, q), and their scores.
    """
    recording, prior = model.recording, model.settings.prior
    rng = generator(seed, "calibration", "local", "speeds", recording.subject)
    speeds = draw_speeds(model.predict(phi), recording.errors, model.settings.discrepancy, rng)
    points = ranks.standardised(references, prior)
    progress = Progress(f"calibration {recording.subject} (local, {sampler})", len(phi), unit="replicate")

    def quantities(drawn: FloatArray, log_likelihood: FloatArray) -> FloatArray:
        return ranks.quantities(drawn, log_likelihood, model.activation_duration_s(drawn))

    truths, scores = [], []
    for index, second in enumerate(speeds):
        both, true = TwoRecordings(model, replace(recording, speed_m_s=second)), phi[index][None]
        stream = integer_seed(seed, "calibration", "local", "exact", recording.subject, index)
        drawn, _ = weighted_posterior(
            HeartModel(both), propose(both.recording), effective_draws, exact, stream
        )
        truths.append(quantities(true, both.log_likelihood(true))[0])
        values = quantities(drawn.phi, drawn.log_likelihood)
        scores.append(ranks.score(truths[-1], values, drawn.weight, points[index], prior))
        progress.step()
    return np.stack(truths), below_each_other(scores)


def calibrate_locally(
    model: SpeedModel,
    flow: TrainedFlow,
    posterior: ExactPosterior,
    sizes: LocalSettings,
    exact: ExactSettings,
    seed: int,
) -> ranks.RankedRecordings:
    """Rank draws of the network's and of the reported posterior of a subject, as many of each.

    Args:
        model: The subject's model.
        flow: The trained network.
        posterior: The reported posterior and the network's draws; at least two draws a replicate.
        sizes: Replicates and weighted draws.
        exact: The study's own settings of the exact posterior.
        seed: Seed of the study.

    Returns:
        Their scores; the truths are those of the reported posterior, the prior variance is its variance.
    """
    propose, count = partial(flow_proposal, flow), sizes.replicates
    given = (model, propose, exact, sizes.effective_draws)
    by_sampler = {
        name: local_scores(*given, phi[:count], phi[count : 2 * count], seed, name)
        for name, phi in ((ranks.NETWORK, posterior.proposal_phi), (ranks.WEIGHTED, posterior.phi))
    }
    return ranks.RankedRecordings(
        names=ranks.quantity_names(model.settings.prior),
        subject=np.full(count, model.recording.subject),
        truth=by_sampler[ranks.WEIGHTED][0],
        prior_variance=np.tile(variance_given_first(model, posterior.phi), (count, 1)),
        network=by_sampler[ranks.NETWORK][1],
        weighted=by_sampler[ranks.WEIGHTED][1],
    )


def variance_given_first(model: SpeedModel, phi: FloatArray) -> FloatArray:
    """Return the variance of each quantity under draws (n, d) given the first recording alone; (d + 2,).

    It takes the place of the prior's variance beside local calibration; the log-likelihood has none (NaN).
    """
    values = ranks.quantities(phi, np.zeros(len(phi)), model.activation_duration_s(phi))
    variance: FloatArray = values.var(axis=0)
    variance[ranks.QUANTITY_NAMES.index(ranks.LOG_LIKELIHOOD)] = np.nan
    return variance
