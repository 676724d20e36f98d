"""The feature-Gaussian observation model (paper, Eq. 5)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def noise_sd(names: Sequence[str], feature_noise_sd: Mapping[str, float]) -> FloatArray:
    """Return the noise's standard deviations of shape (F,), in raw feature units, zero where none is named.

    Raises:
        ValueError: A named feature is none of ``names``.
    """
    if unknown := sorted(set(feature_noise_sd) - set(names)):
        raise ValueError(
            f"feature_noise_sd: {', '.join(unknown)} is not a feature of this experiment's summary; "
            f"its features are {', '.join(names)}"
        )
    return np.array([feature_noise_sd.get(name, 0.0) for name in names])


def augment(features: FloatArray, sd: FloatArray, copies: int, rng: np.random.Generator) -> FloatArray:
    """Return noisy copies x + epsilon of every feature vector, epsilon ~ N(0, diag(sd^2)) (paper, Eq. 5).

    Args:
        features: (n, F) noiseless features of n simulations.
        sd: (F,) standard deviations; only features with a positive one consume random numbers.
        copies: Number N_aug of copies of each.
        rng: The stream of one subject.

    Returns:
        Array of shape (n, copies, F).
    """
    noisy = np.flatnonzero(sd > 0.0)
    copied = np.repeat(features[:, None, :], copies, axis=1)
    copied[:, :, noisy] += sd[noisy] * rng.standard_normal((len(features), copies, len(noisy)))
    return copied
