"""What the figures show of one subject."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swesbi.evaluation.exact_result import ExactResult
from swesbi.evaluation.fit import CmaesFit
from swesbi.evaluation.predictive import PredictiveCheck
from swesbi.inference.support import Support

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class PredictivePanel:
    """One subject's predictive check, reference fit and verdict."""

    subject: str
    check: PredictiveCheck
    fit: CmaesFit
    support: Support


@dataclass(frozen=True)
class PosteriorPanel:
    """One subject's posterior.

    Attributes:
        subject: Name.
        theta: (n, 3) draws within the prior's bounds; shown only where the subject is supported.
        unfiltered: (m, 3) candidates as they came, shown where it is not.
        fit_theta: (3,) the CMA-ES reference fit.
        support: Support diagnostics.
    """

    subject: str
    theta: FloatArray
    unfiltered: FloatArray
    fit_theta: FloatArray
    support: Support


@dataclass(frozen=True)
class ExactPanel:
    """One subject's exact posterior.

    Attributes:
        subject: Name.
        result: Draws, the network's draws, and how reliable they are.
        fit_theta: (3,) the CMA-ES reference fit.
        support: The verdict.
        truth: (3,) active parameters that made the recording, of a generated cohort; else None.
    """

    subject: str
    result: ExactResult
    fit_theta: FloatArray
    support: Support
    truth: FloatArray | None
