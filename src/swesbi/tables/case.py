"""What the tables know of one subject in one experiment."""

from __future__ import annotations

from dataclasses import dataclass

from swesbi.evaluation.fit import CmaesFit
from swesbi.evaluation.predictive import PredictiveCheck
from swesbi.inference.posterior import Posterior
from swesbi.inference.support import Support


@dataclass(frozen=True)
class Case:
    """One subject in one experiment: predictive check, posterior, support, and the CMA-ES fit beside them."""

    experiment: str
    subject: str
    check: PredictiveCheck
    posterior: Posterior
    support: Support
    fit: CmaesFit
