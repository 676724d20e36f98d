"""Importance weights of proposal draws under the exact posterior, Pareto-smoothed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from swesbi.artefacts import Variable
from swesbi.draws import resampled_rows
from swesbi.prior import BoxPrior, draw_prior, log_density
from swesbi.seeds import generator, integer_seed

FloatArray = NDArray[np.float64]


class HasPrior(Protocol):
    """Settings that hold the prior of what is inferred."""

    @property
    def prior(self) -> BoxPrior:
        """The prior of phi."""


class LikelihoodModel(Protocol):
    """The model of one recording: its prior and its likelihood, exact and cheap enough to be evaluated."""

    @property
    def settings(self) -> HasPrior:
        """Hold the prior."""

    def log_likelihood(self, phi: FloatArray) -> FloatArray:
        """Return log p(data | phi) of phi (n, d), -inf where the simulation failed; shape (n,)."""


class Proposal(Protocol):
    """A density over phi, within the prior's box, that can be drawn from."""

    def draw(self, draws: int, seed: int) -> FloatArray:
        """Draw phi; shape (draws, d)."""

    def log_density(self, phi: FloatArray) -> FloatArray:
        """Return log q(phi), per unit of phi, of phi (n, d); shape (n,)."""


class NoLikelihoodError(ValueError):
    """No draw of the proposal has a likelihood; the message says what to do."""


@dataclass(frozen=True)
class WeightedDraws:
    """Draws from the proposal, weighted to the exact posterior.

    Attributes:
        phi: Draws; shape (n, d).
        log_likelihood: -inf where the simulation failed.
        k_hat: Of the largest weights; infinite where there are too few to tell.
        efficiency: Effective sample size over n: 1 / (n sum w^2).
        log_evidence: log p(data), from the weights before smoothing.
    """

    phi: FloatArray
    from_prior: Annotated[
        NDArray[np.bool_],
        Variable("draw", "1", "1 where drawn from the prior, 0 from the network", group="weighted"),
    ]
    log_likelihood: Annotated[
        FloatArray, Variable("draw", "1", "exact log likelihood of the log speeds", group="weighted")
    ]
    log_weight: Annotated[
        FloatArray, Variable("draw", "1", "log of the smoothed weights, which sum to one", group="weighted")
    ]
    k_hat: Annotated[float, Variable("", "1", "Pareto shape of the importance weights")]
    efficiency: Annotated[float, Variable("", "1", "effective share of the weighted draws")]
    log_evidence: Annotated[float, Variable("", "1", "log evidence of the log speeds, from the weights")]
    log_evidence_se: Annotated[float, Variable("", "1", "its Monte Carlo standard error")]

    @property
    def weight(self) -> FloatArray:
        """The smoothed weights, which sum to one; shape (n,)."""
        return np.asarray(np.exp(self.log_weight))


def weigh(
    model: LikelihoodModel, proposal: Proposal, draws: int, prior_fraction: float, seed: int
) -> WeightedDraws:
    """Draw from a mixture of proposal and prior and weight the draws to the exact posterior.

    The weight is p(phi) p(data | phi) / ((1 - f) q(phi) + f p(phi)): the balance heuristic of
    deterministic mixture sampling (Veach and Guibas 1995; Owen and Zhou 2000), which bounds it by the
    largest likelihood over f. The largest weights are then smoothed (Vehtari et al. 2024).

    Args:
        model: Prior and exact likelihood of the recording.
        proposal: q.
        draws: Number n of draws.
        prior_fraction: Share f of them that come from the prior.
        seed: Seed of the draws.

    Raises:
        NoLikelihoodError: The likelihood is zero at every draw.
    """
    prior = model.settings.prior
    of_prior = round(prior_fraction * draws)
    phi = np.concatenate(
        [
            proposal.draw(draws - of_prior, integer_seed(seed, "importance", "proposal")),
            draw_prior(prior, of_prior, generator(seed, "importance", "prior")),
        ]
    )
    log_prior = log_density(phi, prior)
    # where q is too narrow, the prior's share keeps the mixture above f p(phi), and so the weight bounded
    log_mixture = _log_mixture(proposal.log_density(phi), log_prior, of_prior / draws)
    log_likelihood = model.log_likelihood(phi)
    log_ratio = log_prior + log_likelihood - log_mixture
    if not np.isfinite(log_ratio).any():
        raise NoLikelihoodError(
            f"none of {draws} draws has a likelihood: every simulation failed; check the subject's context"
        )
    # a few extreme weights would dominate every mean: smoothing bounds them, at the price of a small bias, so
    # the evidence, whose estimate the raw ratios leave unbiased, is taken from these
    log_weight, k_hat = smooth(log_ratio)
    log_evidence, error = evidence(log_ratio)
    return WeightedDraws(
        phi=phi,
        from_prior=np.arange(draws) >= draws - of_prior,
        log_likelihood=log_likelihood,
        log_weight=log_weight,
        k_hat=k_hat,
        efficiency=float(np.exp(-logsumexp(2.0 * log_weight)) / draws),
        log_evidence=log_evidence,
        log_evidence_se=error,
    )


def smooth(log_ratio: FloatArray) -> tuple[FloatArray, float]:
    """Smooth the largest importance ratios by a generalised Pareto distribution.

    Args:
        log_ratio: Logarithms of the ratios, -inf where one is zero; shape (n,).

    Returns:
        Logarithms of the weights, which sum to one, and the Pareto shape k-hat.
    """
    import arviz  # two seconds with pyplot, and most who import this module only read posteriors

    log_weight, k_hat = arviz.psislw(log_ratio)  # type: ignore[no-untyped-call]
    return np.asarray(log_weight), float(k_hat)


def k_hat_limit(draws: int, largest: float = 0.7) -> float:
    """Return the Pareto shape above which weights of so many draws are not reliable.

    min(largest, 1 - 1/log10(draws)) (Vehtari et al. 2024, Sec. 3.2.4).
    """
    return float(min(largest, 1.0 - 1.0 / np.log10(draws)))


def resample(weighted: WeightedDraws, draws: int, rng: np.random.Generator) -> FloatArray:
    """Return equally weighted draws (draws, d) by systematic resampling, in random order."""
    rows = resampled_rows(weighted.weight, draws, rng)
    return np.asarray(weighted.phi[rng.permutation(rows)])


def _log_mixture(log_q: FloatArray, log_prior: FloatArray, prior_fraction: float) -> FloatArray:
    mixture = np.logaddexp(np.log1p(-prior_fraction) + log_q, np.log(prior_fraction) + log_prior)
    return np.asarray(mixture)


def evidence(log_ratio: FloatArray) -> tuple[float, float]:
    """Return the logarithm of the mean ratio and its standard error (delta method)."""
    largest = log_ratio.max()
    ratio = np.exp(log_ratio - largest)
    mean = float(ratio.mean())
    return float(largest + np.log(mean)), float(ratio.std(ddof=1) / np.sqrt(len(ratio)) / mean)
