"""Recordings of known parameters with the scores of both samplers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import Labels, Part, Variable
from swesbi.calibration.scores import EACH, Scores

FloatArray = NDArray[np.float64]
NETWORK: Final = "npe"
WEIGHTED: Final = "weighted"
SAMPLERS: Final = (NETWORK, WEIGHTED)


@dataclass(frozen=True)
class Ranked:
    """n recordings, q quantities, with the context and protocol of ``subject``; no prior variance is NaN."""

    subject: Annotated[NDArray[np.str_], Labels("recording", "subject")]
    truth: Annotated[FloatArray, Variable("recording quantity", EACH, "true value")]
    prior_variance: Annotated[
        FloatArray, Variable("recording quantity", f"{EACH}, squared", "before the recording is seen")
    ]
    network: Annotated[Scores, Part("npe_{}", words={"sampler": "the network"})]
    weighted: Annotated[Scores, Part("weighted_{}", words={"sampler": "the exact posterior"})]

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
    """What the exact posteriors of n recordings leave beside their scores; residuals are standardised."""

    k_hat: Annotated[FloatArray, Variable("recording", "1", "Pareto shape of the importance weights")]
    efficiency: Annotated[FloatArray, Variable("recording", "1", "effective share of the weighted draws")]
    log_evidence: Annotated[
        FloatArray, Variable("recording", "1", "log evidence of the log speeds, from the weights")
    ]
    by_mcmc: Annotated[
        NDArray[np.bool_], Variable("recording", "1", "1 where MCMC took over from the weights")
    ]
    phases: Annotated[NDArray[np.int64], Variable("recording", "1", "measured phases")]
    min_chi2: Annotated[
        FloatArray,
        Variable("recording", "1", "smallest sum of squared residuals over posterior draws"),
    ]
    mean_chi2: Annotated[
        FloatArray, Variable("recording", "1", "mean sum of squared residuals over posterior draws")
    ]
    strip_mass: Annotated[
        FloatArray,
        Variable("recording parameter bound", "1", "posterior mass in the strip at each bound of the prior"),
    ]


@dataclass(frozen=True)
class Inferred:
    """Recordings with their scores and what else their exact posteriors say."""

    ranked: Annotated[Ranked, Part()]
    diagnostics: Annotated[Diagnostics, Part()]
