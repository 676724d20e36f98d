"""What is kept of the posteriors of many recordings: levels of the truth, and moments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import Variable
from swesbi.calibration.levels import FloatArray, level_of_truth, moments
from swesbi.calibration.tarp import tarp_level
from swesbi.prior import BoxPrior

EACH: Final = "as named in quantity"


@dataclass(frozen=True)
class Score:
    """One posterior against its truth.

    Attributes:
        level: Mid-rank of the truth in each quantity; shape (q,).
        tarp: Posterior mass nearer to the reference point than the truth.
        mean: Posterior means; shape (q,).
        sd: Posterior standard deviations; shape (q,).
    """

    level: FloatArray
    tarp: float
    mean: FloatArray
    sd: FloatArray


@dataclass(frozen=True)
class Scores:
    """The posteriors of n recordings under one sampler; arrays as in :class:`Score`, recordings first."""

    level: Annotated[
        FloatArray,
        Variable("recording quantity", "1", "mid-rank of the truth among the draws of {sampler}"),
    ]
    tarp: Annotated[
        FloatArray, Variable("recording", "1", "mass of {sampler} nearer to a random point than the truth")
    ]
    mean: Annotated[FloatArray, Variable("recording quantity", EACH, "mean of {sampler}")]
    sd: Annotated[FloatArray, Variable("recording quantity", EACH, "standard deviation of {sampler}")]

    def rows(self, chosen: NDArray[np.bool_]) -> Scores:
        """Return the recordings that are chosen; shape (n,)."""
        return Scores(self.level[chosen], self.tarp[chosen], self.mean[chosen], self.sd[chosen])


def score(
    truth: FloatArray, draws: FloatArray, weight: FloatArray, reference: FloatArray, prior: BoxPrior
) -> Score:
    """Rank one truth among its posterior draws.

    Args:
        truth: True quantities, the d parameters of the prior first; shape (q,).
        draws: The quantities of n draws; shape (n, q).
        weight: Normalised weights; shape (n,).
        reference: Standardised reference point of the joint coverage; shape (d,).
        prior: Prior of the d parameters.
    """
    d, moment = len(prior.parameters), moments(draws, weight)
    tarp = tarp_level(truth[:d], draws[:, :d], weight, reference, prior)
    return Score(level_of_truth(truth, draws, weight), tarp, moment.mean, moment.sd)


def stack_scores(scores: Sequence[Score]) -> Scores:
    """Put the scores of n recordings together, in order."""
    return Scores(
        level=np.stack([one.level for one in scores]),
        tarp=np.array([one.tarp for one in scores]),
        mean=np.stack([one.mean for one in scores]),
        sd=np.stack([one.sd for one in scores]),
    )
