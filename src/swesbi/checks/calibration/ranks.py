"""What is kept of recordings of known parameters: ranks and levels of the truth among a posterior's draws.

Joint coverage (TARP): Lemos, Coogan, Hezaveh and Perreault-Levasseur (2023), Sampling-based accuracy testing
of posterior estimators for general inference, ICML. The function of sbi takes its own posterior objects and
equally weighted draws; the one here takes arrays with weights.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.artefacts import Labels, Part, Variable
from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.checks.recovery import ScoredPosteriors
from swesbi.draws import effective_draws, equal_weights
from swesbi.heart.model import isometric_stiffness_kpa
from swesbi.measurement.likelihood import SpeedModel
from swesbi.parameters import ISOMETRIC, OF_INTEREST, PHI_NAMES, THETA_NAMES
from swesbi.posterior.importance import WeightedDraws
from swesbi.prior import BoxPrior, JointPriorSettings, quantile, spread_points
from swesbi.prior import prior_variance as prior_variance_of
from swesbi.verdict.misfits import Misfits

LOG_LIKELIHOOD: Final = "log_likelihood"
QUANTITY_NAMES: Final = (*PHI_NAMES, ISOMETRIC, LOG_LIKELIHOOD)
EACH: Final = "as named in quantity"
NETWORK: Final = "proposal"
WEIGHTED: Final = "weighted"
SAMPLERS: Final = (NETWORK, WEIGHTED)


def level_of_truth(truth: FloatArray, draws: FloatArray, weight: FloatArray) -> FloatArray:
    """Return the mid-rank of the truth among n draws as a level in (0, 1); shape (q,).

    For L equal weights the truth's rank r among the draws is uniform on 0..L if the posterior is right
    (Talts et al. 2018, Validating Bayesian inference algorithms with simulation-based calibration), and the
    level is (r + 1/2) / (L + 1). For unequal weights r is L times the weight below the truth, with L the
    effective number of draws. Ties count by half.

    Args:
        truth: True values; shape (q,).
        draws: Posterior draws; shape (n, q).
        weight: Normalised weights; shape (n,).
    """
    below = weight @ (draws < truth) + 0.5 * (weight @ (draws == truth))
    number = effective_draws(weight)
    return np.asarray((number * below + 0.5) / (number + 1.0))


def central_level(level: FloatArray) -> FloatArray:
    """Return |2 u - 1| for levels u: the mass of the smallest central interval that contains the truth.

    Its distribution function at a nominal level is the coverage of the equal-tailed interval of that mass.
    """
    return np.abs(2.0 * level - 1.0)


def moments(draws: FloatArray, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return weighted mean and sd (q,) of draws (n, q) that carry weight; others may hold anything.

    A quantity that is -inf in one of them, the log-likelihood of a simulation that failed, has mean -inf and
    standard deviation NaN.
    """
    used = weight > 0.0
    kept, share = draws[used], weight[used]
    mean = share @ kept
    with np.errstate(invalid="ignore"):  # -inf less -inf
        return mean, np.sqrt(share @ (kept - mean) ** 2)


def quantity_names(prior: JointPriorSettings) -> tuple[str, ...]:
    """Return the names of the quantities that are ranked: ``QUANTITY_NAMES``, then nuisance parameters."""
    return (*QUANTITY_NAMES, *prior.nuisance_names)


def quantities(phi: FloatArray, log_likelihood: FloatArray, duration_s: FloatArray | float) -> FloatArray:
    """Return the quantities of ``QUANTITY_NAMES``, then the nuisance parameters, of n draws; (n, d + 2).

    k_0 (1 - exp(-k_ATP D_T)) is what the data know best of k_0 and k_ATP. The log-likelihood depends on the
    data, and so finds posteriors that are calibrated in every parameter without having seen them (Modrák
    et al. 2023, Simulation-based calibration checking for Bayesian computation: the choice of test quantities
    shapes sensitivity).

    Args:
        phi: Draws; shape (n, d).
        log_likelihood: Their log-likelihood; shape (n,).
        duration_s: Duration D_T of the activation, of each draw or of all.
    """
    isometric = isometric_stiffness_kpa(phi, duration_s)
    return np.column_stack([phi[:, OF_INTEREST], isometric, log_likelihood, phi[:, OF_INTEREST.stop :]])


def prior_variance(model: SpeedModel) -> FloatArray:
    """Return the prior variance of each quantity; shape (d + 2,). The log-likelihood has none (NaN)."""
    prior = model.settings.prior
    phi, of_phi = spread_points(prior), prior_variance_of(prior)
    isometric = isometric_stiffness_kpa(phi, model.activation_duration_s(phi)).var()
    return np.array([*of_phi[OF_INTEREST], isometric, np.nan, *of_phi[OF_INTEREST.stop :]])


def standardised(phi: FloatArray, prior: BoxPrior) -> FloatArray:
    """Return log(phi / centre) / log_sd of shape (..., d), in which distances are taken."""
    centre = np.array([parameter.centre for parameter in prior.parameters])
    log_sd = np.array([parameter.log_sd for parameter in prior.parameters])
    return np.asarray(np.log(phi / centre) / log_sd)


def reference_points(count: int, prior: BoxPrior, rng: np.random.Generator) -> FloatArray:
    """Draw a reference point for each recording, from the prior and independent of everything; (count, d)."""
    return standardised(quantile(rng.random((count, len(prior.parameters))), prior), prior)


def tarp_level(
    truth: FloatArray, draws: FloatArray, weight: FloatArray, reference: FloatArray, prior: BoxPrior
) -> float:
    """Return the posterior mass nearer to the reference point than the truth; uniform if calibrated.

    Args:
        truth: True phi; shape (d,).
        draws: Posterior draws; shape (n, d).
        weight: Normalised weights; shape (n,).
        reference: A standardised reference point; shape (d,).
        prior: Sets the scale of each parameter.
    """
    of_truth = np.linalg.norm(standardised(truth[None], prior) - reference, axis=1)
    of_draws = np.linalg.norm(standardised(draws, prior) - reference, axis=1)
    return float(level_of_truth(of_truth, of_draws[:, None], weight)[0])


@dataclass(frozen=True)
class RankScores:
    """The posteriors of n recordings under one sampler, each against its truth."""

    level: Annotated[
        FloatArray, Variable("recording quantity", "1", "mid-rank of the truth among the draws of {sampler}")
    ]
    tarp: Annotated[
        FloatArray, Variable("recording", "1", "mass of {sampler} nearer to a random point than the truth")
    ]
    mean: Annotated[FloatArray, Variable("recording quantity", EACH, "mean of {sampler}")]
    sd: Annotated[FloatArray, Variable("recording quantity", EACH, "standard deviation of {sampler}")]
    effective_draws: Annotated[FloatArray, Variable("recording", "1", "effective draws of {sampler}")]


def score(
    truth: FloatArray, draws: FloatArray, weight: FloatArray, reference: FloatArray, prior: BoxPrior
) -> RankScores:
    """Rank one truth among its posterior draws; one row.

    Args:
        truth: True quantities; shape (q,).
        draws: The quantities of n draws; shape (n, q).
        weight: Normalised weights; shape (n,).
        reference: Standardised reference point of the joint coverage; shape (d,).
        prior: Prior of the d parameters.
    """
    of_phi = [*range(OF_INTEREST.stop), *range(len(QUANTITY_NAMES), len(truth))]
    mean, sd = moments(draws, weight)
    tarp = tarp_level(truth[of_phi], draws[:, of_phi], weight, reference, prior)
    level, number = level_of_truth(truth, draws, weight), effective_draws(weight)
    return RankScores(level[None], np.array([tarp]), mean[None], sd[None], np.array([number]))


@dataclass(frozen=True)
class RankedRecordings:
    """n recordings, q quantities, with the context and protocol of ``subject``; no prior variance is NaN."""

    names: Annotated[tuple[str, ...], Labels("quantity")]
    subject: Annotated[NDArray[np.str_], Labels("recording", "subject")]
    truth: Annotated[FloatArray, Variable("recording quantity", EACH, "true value")]
    prior_variance: Annotated[
        FloatArray, Variable("recording quantity", f"{EACH}, squared", "before the recording is seen")
    ]
    network: Annotated[RankScores, Part("proposal_{}", words={"sampler": "the network"})]
    weighted: Annotated[RankScores, Part("weighted_{}", words={"sampler": "the exact posterior"})]

    def of(self, sampler: str) -> RankScores:
        """Return the scores of a sampler of ``SAMPLERS``."""
        return {NETWORK: self.network, WEIGHTED: self.weighted}[sampler]

    def recovered(self, sampler: str = WEIGHTED) -> ScoredPosteriors:
        """Return the posteriors of theta, which come first among the quantities, as they are scored."""
        columns, scores = slice(0, len(THETA_NAMES)), self.of(sampler)
        return ScoredPosteriors(
            truth=self.truth[:, columns],
            mean=scores.mean[:, columns],
            variance=scores.sd[:, columns] ** 2,
            level_of_truth=scores.level[:, columns],
        )


def ranked(
    model: SpeedModel,
    log_likelihood: Callable[[FloatArray], FloatArray],
    phi: FloatArray,
    network: FloatArray,
    drawn: WeightedDraws,
    reference: FloatArray,
    variance: FloatArray,
) -> RankedRecordings:
    """Rank the true phi of one recording among the network's draws, and among weighted ones.

    Args:
        model: The recording's model.
        log_likelihood: Of phi (n, d), given the recording.
        phi: True parameters; shape (d,).
        network: Draws of the network; shape (n, d).
        drawn: Draws of the exact posterior.
        reference: Standardised reference point of the joint coverage; shape (d,).
        variance: Prior variance of each quantity; shape (d + 2,).
    """
    prior, both = model.settings.prior, np.concatenate([phi[None], network])
    truth, *rest = quantities(both, log_likelihood(both), model.activation_duration_s(both))
    values = quantities(drawn.phi, drawn.log_likelihood, model.activation_duration_s(drawn.phi))
    return RankedRecordings(
        names=quantity_names(prior),
        subject=np.array([model.recording.subject]),
        truth=truth[None],
        prior_variance=variance[None],
        network=score(truth, np.stack(rest), equal_weights(len(rest)), reference, prior),
        weighted=score(truth, values, drawn.weight, reference, prior),
    )


@dataclass(frozen=True)
class Diagnostics:
    """What the exact posteriors of n recordings leave beside their scores."""

    k_hat: Annotated[FloatArray, Variable("recording", "1", "Pareto shape of the importance weights")]
    efficiency: Annotated[FloatArray, Variable("recording", "1", "effective share of the weighted draws")]
    log_evidence: Annotated[
        FloatArray, Variable("recording", "1", "log evidence of the log speeds, from the weights")
    ]
    by_mcmc: Annotated[BoolArray, Variable("recording", "1", "1 where MCMC took over from the weights")]


@dataclass(frozen=True)
class InferredRecordings:
    """Recordings with scores, what else their exact posteriors say, and what the verdict sees."""

    ranked: Annotated[RankedRecordings, Part()]
    diagnostics: Annotated[Diagnostics, Part()]
    misfits: Annotated[Misfits, Part()]


@dataclass(frozen=True)
class TwoSamples:
    """Whether a classifier tells two samplers apart, by subject and pair of them, each joined by a space."""

    subject: Annotated[tuple[str, ...], Labels("subject")]
    pair: Annotated[tuple[str, ...], Labels("pair")]
    accuracy: Annotated[
        FloatArray, Variable("subject pair", "1", "accuracy of a classifier between two samplers")
    ]
    draws: Annotated[FloatArray, Variable("subject pair", "1", "draws of each sampler; NaN: not compared")]

    @classmethod
    def joined(cls, parts: Sequence[TwoSamples]) -> TwoSamples:
        """Return those of several subjects, in the order given; NaN for a pair that one has not.

        Pairs are in the order of their names where not all have the same.
        """
        pairs = parts[0].pair
        if any(part.pair != pairs for part in parts):
            pairs = tuple(sorted({pair for part in parts for pair in part.pair}))

        def of_all(name: str) -> FloatArray:
            tables = [pd.DataFrame(getattr(part, name), columns=list(part.pair)) for part in parts]
            return pd.concat(tables).reindex(columns=list(pairs)).to_numpy()

        subjects = tuple(subject for part in parts for subject in part.subject)
        return cls(subjects, pairs, of_all("accuracy"), of_all("draws"))
