"""The true parameters of a generated cohort."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from swesbi.artefacts import ArtefactError
from swesbi.artefacts.csv import read_csv
from swesbi.base.arrays import FloatArray
from swesbi.parameters import THETA_NAMES


class Truths(dict[str, FloatArray]):
    """True theta (3,) of each subject of a generated cohort, by ``truth.csv``.

    The passive stiffness is not among them: that of a generated subject goes with a passive law of its own,
    and is another quantity than the model's.
    """

    @classmethod
    def read(cls, path: Path) -> Truths:
        """Read ``truth.csv``; one without a parameter is an ArtefactError."""
        table = read_csv(path)
        if missing := [name for name in ("subject", *THETA_NAMES) if name not in table]:
            raise ArtefactError(f"{path}: lacks the columns {', '.join(missing)}")
        values = table[list(THETA_NAMES)].to_numpy(dtype=np.float64)
        return cls(zip(table["subject"], values, strict=True))
