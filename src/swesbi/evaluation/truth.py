"""The parameters that made a generated cohort: for comparison with posteriors, and read for nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.artefacts import ArtefactError
from swesbi.parameters import THETA_NAMES

FloatArray = NDArray[np.float64]


def read_truth(paths: Sequence[Path]) -> Mapping[str, FloatArray]:
    """Return the true theta (3,) of each subject from ``truth.csv``; empty where the cohort has no such file.

    The passive scale is not among them: that of a generated subject goes with a passive law of its own, and
    is another quantity than the model's.

    Args:
        paths: The file, or none.

    Raises:
        ArtefactError: The file lacks a parameter.
    """
    truths: dict[str, FloatArray] = {}
    for path in paths:
        table = pd.read_csv(path, dtype={"subject": str})
        if missing := [name for name in ("subject", *THETA_NAMES) if name not in table]:
            raise ArtefactError(f"{path}: lacks the columns {', '.join(missing)}")
        values = table[list(THETA_NAMES)].to_numpy(dtype=np.float64)
        truths |= dict(zip(table["subject"], values, strict=True))
    return truths
