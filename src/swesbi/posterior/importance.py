"""Importance weights of proposal draws under the exact posterior, Pareto-smoothed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import Variable
from swesbi.base.arrays import FloatArray
from swesbi.draws import resampled_rows
from swesbi.prior import BoxPrior


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


@dataclass(frozen=True)
class EvaluatedPoints:
    """n points of a sampler under a recording; a failed simulation has the log likelihood -inf.

    phi (n, d) are all parameters: those that are integrated out are drawn given data and point. ``beside``
    (n,) is the log density of what is known beside the recording and not counted yet.
    """

    log_likelihood: FloatArray
    phi: FloatArray
    log_likelihood_of_phi: FloatArray
    beside: FloatArray

    def with_more(self, more: EvaluatedPoints) -> EvaluatedPoints:
        """Return these and further points."""
        return EvaluatedPoints(
            np.concatenate([self.log_likelihood, more.log_likelihood]),
            np.concatenate([self.phi, more.phi]),
            np.concatenate([self.log_likelihood_of_phi, more.log_likelihood_of_phi]),
            np.concatenate([self.beside, more.beside]),
        )

    def informed(self) -> EvaluatedPoints:
        """Return them with what is known beside the recording counted."""
        of_points, of_phi = self.log_likelihood + self.beside, self.log_likelihood_of_phi + self.beside
        return EvaluatedPoints(of_points, self.phi, of_phi, np.zeros_like(self.beside))


@runtime_checkable
class MarginalModel(LikelihoodModel, Protocol):
    """The model of one recording of which a sampler sees fewer parameters: the others are integrated out."""

    @property
    def prior(self) -> BoxPrior:
        """The prior of all d parameters; that of ``settings`` is of the points alone."""

    def points(self, phi: FloatArray) -> FloatArray:
        """Return what a sampler sees, (n, k), of phi (n, d)."""

    def evaluated(self, points: FloatArray) -> EvaluatedPoints:
        """Return points (n, k) with their likelihood, and with all parameters."""


def evaluate(model: LikelihoodModel, points: FloatArray) -> EvaluatedPoints:
    """Return points of a sampler (n, k) with their likelihood, and with all parameters."""
    if isinstance(model, MarginalModel):
        return model.evaluated(points)
    log_likelihood = model.log_likelihood(points)
    return EvaluatedPoints(log_likelihood, points, log_likelihood, np.zeros_like(log_likelihood))


def points_of(model: LikelihoodModel, phi: FloatArray) -> FloatArray:
    """Return what a sampler sees of all parameters, phi (n, d); shape (n, k)."""
    return model.points(phi) if isinstance(model, MarginalModel) else phi


def prior_of_all(model: LikelihoodModel) -> BoxPrior:
    """Return the prior of all parameters, whichever of them a sampler sees."""
    return model.prior if isinstance(model, MarginalModel) else model.settings.prior


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
    """Draws from the proposal, weighted to the exact posterior; phi has the shape (n, d).

    The efficiency is 1 / (n sum w^2). The evidence log p(data) is that of the weights before smoothing.
    k-hat is infinite where there are too few large weights to tell.
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
