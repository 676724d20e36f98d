"""Calibration at one subject's own data: draws of its posterior, ranked given a second recording of each.

Säilynoja, Schmitt, Bürkner and Vehtari (2025), Posterior SBC: simulation-based calibration checking
conditional on data. If phi is drawn from the posterior given the subject's recording and a second recording
is simulated from it, phi is a draw from the posterior given both. Its rank there is uniform where the first
draw was right, whatever holds elsewhere under the prior. The posterior given both is exact and new for each
second recording, so that neither sampler is judged by itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from swesbi.artefacts import UnfitError
from swesbi.base.arrays import FloatArray, below_each_other
from swesbi.base.progress import Progress
from swesbi.checks.calibration.dataset import CalibrationLocal
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
from swesbi.checks.calibration.two_samples import compare_samplers
from swesbi.checks.settings import LocalSettings
from swesbi.measurement.instants import CellErrors
from swesbi.measurement.likelihood import (
    SpeedModel,
    SpeedModelSettings,
    draw_speeds,
    log_likelihood,
    residuals,
    speed_model,
)
from swesbi.measurement.shared_error import Errors
from swesbi.measurement.speeds import PredictedSpeeds, SpeedRecording
from swesbi.networks.flow.flow import flow_proposal
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.posterior.exact import weighted_posterior
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.settings import ExactSettings
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.seeds import generator, integer_seed


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
