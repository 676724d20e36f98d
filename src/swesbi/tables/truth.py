"""Do the credible intervals hold the parameters that made the recordings of a generated cohort?"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.evaluation.verdict import status
from swesbi.inference.posterior import Posterior
from swesbi.inference.support import Support
from swesbi.parameters import THETA_NAMES

FloatArray = NDArray[np.float64]

COLUMNS: Final = (
    "experiment",
    "subject",
    "status",
    "parameter",
    "truth",
    "median",
    "low",
    "high",
    "inside",
)


@dataclass(frozen=True)
class Answer:
    """The posterior of one subject in one experiment, with its verdict."""

    experiment: str
    subject: str
    posterior: Posterior
    support: Support


def truth_table(answers: Sequence[Answer], truths: Mapping[str, FloatArray]) -> pd.DataFrame:
    """Return one row an experiment, subject and active parameter.

    ``low`` and ``high`` are the ends of the credible interval; they and the median are missing where the
    subject is not supported, whose posterior is not reported. Subjects without a known truth have no row.

    Args:
        answers: Posteriors.
        truths: True theta (3,) by subject.
    """
    rows = [row for answer in answers if answer.subject in truths for row in _rows(answer, truths)]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _rows(answer: Answer, truths: Mapping[str, FloatArray]) -> Iterator[dict[str, Any]]:
    reported = 1.0 if answer.support.supported else np.nan
    for j, name in enumerate(THETA_NAMES):
        truth = float(truths[answer.subject][j])
        low, high = reported * answer.posterior.interval[j]
        yield {
            "experiment": answer.experiment,
            "subject": answer.subject,
            "status": status(answer.support),
            "parameter": name,
            "truth": truth,
            "median": reported * answer.posterior.median[j],
            "low": low,
            "high": high,
            "inside": bool(low <= truth <= high) if answer.support.supported else None,
        }
