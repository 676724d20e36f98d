"""Importance weights of proposal draws under the exact posterior, Pareto-smoothed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import Variable
from swesbi.draws import resampled_rows
from swesbi.prior import BoxPrior

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


def k_hat_limit(draws: int, largest: float = 0.7) -> float:
    """Return the Pareto shape above which weights of so many draws are not reliable.

    min(largest, 1 - 1/log10(draws)) (Vehtari et al. 2024, Sec. 3.2.4), of one draw as of two: it is finite.
    """
    return float(min(largest, 1.0 - 1.0 / np.log10(max(draws, 2))))


def resample(weighted: WeightedDraws, draws: int, rng: np.random.Generator) -> FloatArray:
    """Return equally weighted draws (draws, d) by systematic resampling, in random order."""
    rows = resampled_rows(weighted.weight, draws, rng)
    return np.asarray(weighted.phi[rng.permutation(rows)])


def evidence(log_ratio: FloatArray) -> tuple[float, float]:
    """Return the logarithm of the mean ratio and its standard error (delta method)."""
    largest = log_ratio.max()
    ratio = np.exp(log_ratio - largest)
    mean = float(ratio.mean())
    return float(largest + np.log(mean)), float(ratio.std(ddof=1) / np.sqrt(len(ratio)) / mean)
