"""A recording of a virtual volunteer, and the true theta that it came from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.parameters import THETA_NAMES
from swesbi.recording.samples import Samples
from swesbi.seeds import generator
from swesbi.virtual_cohort.acquisition import acquire
from swesbi.virtual_cohort.truth import Truth


def record(truth: Truth, seed: int) -> Samples:
    """Record a volunteer with the acquisition noise of this seed; each volunteer has a stream of its own.

    The shipped recordings are those of ``ACQUISITION_SEED``.
    """
    volunteer = truth.volunteer
    stream = generator(seed, "acquisition", volunteer.context.subject)
    return acquire(truth.curve, volunteer.context, volunteer.acquisition, stream)


def read_true_theta(path: Path) -> dict[str, NDArray[np.float64]]:
    """Read the true theta, shape (3,) in the order of ``THETA_NAMES``, of each subject of ``truth.csv``."""
    table = pd.read_csv(path, dtype={"subject": str}).set_index("subject")
    values = table[list(THETA_NAMES)].to_numpy(dtype=np.float64)
    return dict(zip(table.index, values, strict=True))
