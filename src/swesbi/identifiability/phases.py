"""Which phases inform which quantity: expected when each is left out, and found by reweighting draws."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import arviz as az
import numpy as np
from numpy.typing import NDArray

from swesbi.identifiability.laplace import expected_sd

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class PhaseInformation:
    """What p phases tell of q quantities; (q, p) each.

    Attributes:
        share: Share of the phase in the expected information about the quantity, all else known.
        sd_increase: By what fraction the expected posterior sd of the log grows without the phase.
    """

    share: FloatArray
    sd_increase: FloatArray


@dataclass(frozen=True)
class LeftOut:
    """The posterior of log quantities without one phase, by reweighting the draws; p phases.

    Attributes:
        sd_increase: Relative change of the posterior sd; (q, p).
        mean_shift: Change of the posterior mean, in posterior sd; (q, p).
        k_hat: Pareto k of the weights, which are trustworthy below 0.7; (p,).
    """

    sd_increase: FloatArray
    mean_shift: FloatArray
    k_hat: FloatArray


def phase_information(by_phase: FloatArray, precision: FloatArray, gradient: FloatArray) -> PhaseInformation:
    """Compare the information with and without each phase.

    Args:
        by_phase: Each phase's expected information in log phi, at n draws; (n, p, d, d).
        precision: Of the prior; (d, d).
        gradient: d log quantity / d log phi; (n, q, d).

    The share of a phase in the information about a quantity with gradient g is that along the direction
    g / |g|^2, in which the log quantity rises by its own amount.
    """
    total = by_phase.sum(axis=1)
    without = np.moveaxis(total[:, None] - by_phase, 1, 0)
    whole = expected_sd(precision, total, gradient)
    direction = gradient / np.sum(gradient**2, axis=2, keepdims=True)
    along = np.einsum("nqj,npjk,nqk->nqp", direction, by_phase, direction).mean(axis=0)
    return PhaseInformation(
        share=along / along.sum(axis=1, keepdims=True),
        sd_increase=(expected_sd(precision, without, gradient) / whole).T - 1.0,
    )


def leave_phases_out(log_quantities: FloatArray, log_likelihood_by_phase: FloatArray) -> LeftOut:
    """Reweight posterior draws by 1 / p(y_i | phi), which is the posterior without datum i.

    Gelfand, Dey and Chang (Bayesian Statistics 4, 1992); the weights are Pareto-smoothed (Vehtari,
    Gelman and Gabry, Stat Comput 27:1413, 2017).

    Args:
        log_quantities: Posterior draws of log quantities; (n, q).
        log_likelihood_by_phase: log p(y_i | phi) at the draws; (n, p).
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # k-hat is reported beside the results
        log_weight, k_hat = az.psislw(-log_likelihood_by_phase.T)  # type: ignore[no-untyped-call]
    weight = np.exp(np.asarray(log_weight))
    weight /= weight.sum(axis=1, keepdims=True)
    mean, sd = log_quantities.mean(axis=0), log_quantities.std(axis=0)
    mean_without = weight @ log_quantities
    spread = log_quantities[None] - mean_without[:, None]
    sd_without = np.sqrt(np.einsum("pn,pnq->pq", weight, spread**2))
    return LeftOut((sd_without / sd).T - 1.0, ((mean_without - mean) / sd).T, np.atleast_1d(k_hat))
