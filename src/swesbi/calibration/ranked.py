"""Recordings of known parameters with the scores of both samplers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.calibration.scores import Scores

FloatArray = NDArray[np.float64]
NETWORK: Final = "npe"
WEIGHTED: Final = "weighted"
SAMPLERS: Final = (NETWORK, WEIGHTED)


@dataclass(frozen=True)
class Ranked:
    """n recordings, q quantities.

    Attributes:
        subject: Whose context and protocol each recording has; shape (n,).
        truth: True quantities; shape (n, q).
        prior_variance: Variance of each quantity before the recording is seen; shape (n, q), NaN for none.
        network: Scores of the network's draws.
        weighted: Scores of the exact posterior.
    """

    subject: NDArray[np.str_]
    truth: FloatArray
    prior_variance: FloatArray
    network: Scores
    weighted: Scores

    def of(self, sampler: str) -> Scores:
        """Return the scores of a sampler of ``SAMPLERS``."""
        return {NETWORK: self.network, WEIGHTED: self.weighted}[sampler]

    def rows(self, chosen: NDArray[np.bool_]) -> Ranked:
        """Return the recordings that are chosen; shape (n,)."""
        return Ranked(
            self.subject[chosen],
            self.truth[chosen],
            self.prior_variance[chosen],
            self.network.rows(chosen),
            self.weighted.rows(chosen),
        )


@dataclass(frozen=True)
class Diagnostics:
    """What the exact posteriors of n recordings leave beside their scores.

    Attributes:
        k_hat, efficiency, log_evidence: Of the importance weights; shape (n,).
        by_mcmc: Whether MCMC took over from the weights; shape (n,).
        phases: Measured phases; shape (n,).
        min_chi2, mean_chi2: Sum of squared standardised residuals over posterior draws; shape (n,).
        strip_mass: Posterior mass at the lower and upper bound of each parameter; shape (n, 4, 2).
    """

    k_hat: FloatArray
    efficiency: FloatArray
    log_evidence: FloatArray
    by_mcmc: NDArray[np.bool_]
    phases: NDArray[np.int64]
    min_chi2: FloatArray
    mean_chi2: FloatArray
    strip_mass: FloatArray


@dataclass(frozen=True)
class Inferred:
    """Recordings with their scores and what else their exact posteriors say."""

    ranked: Ranked
    diagnostics: Diagnostics
