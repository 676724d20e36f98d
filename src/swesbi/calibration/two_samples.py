"""Can a classifier tell the draws of two samplers apart?"""

from __future__ import annotations

import warnings

import numpy as np
import torch
from numpy.typing import NDArray
from sbi.utils.metrics import c2st

from swesbi.inference.determinism import reproducible
from swesbi.prior import JointPriorSettings, to_logit

FloatArray = NDArray[np.float64]


def classifier_accuracy(first: FloatArray, second: FloatArray, prior: JointPriorSettings, seed: int) -> float:
    """Return the cross-validated accuracy of telling two equal samples (n, 4) of phi apart.

    One half where the distributions are the same (Lopez-Paz and Oquab 2017); by the multilayer perceptron of
    sbi, in the logit of the prior's box. NaN where a sample holds NaN: nothing was there to compare.

    Raises:
        ValueError: The samples differ in size, so that one half would not mean equality.
    """
    if len(first) != len(second):
        raise ValueError(f"C2ST needs samples of one size, got {len(first)} and {len(second)} draws")
    if np.isnan(first).any() or np.isnan(second).any():
        return float("nan")
    pair = [torch.from_numpy(to_logit(phi, prior).astype(np.float32)) for phi in (first, second)]
    with reproducible(seed), warnings.catch_warnings():
        # a perceptron stopped by its number of iterations is still a classifier
        warnings.simplefilter("ignore")
        return float(c2st(*pair, seed=seed, classifier="mlp"))
