"""Vectors of log ratios and sets of chains, and what ArviZ finds of them.

`python tests/helpers/diagnostics_case.py` writes the columns of the ArviZ that is installed, of either
generation, into `tests/reference/diagnostics.csv`; the other columns stay.
"""

from __future__ import annotations

import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.signal import lfilter
from scipy.special import ndtri

CASES = 200
REFERENCE = Path(__file__).parents[1] / "reference" / "diagnostics.csv"


def log_ratios(case: int) -> np.ndarray:
    """Logarithms of importance ratios of a known law: normal, Pareto, some zero, or a tail of many nats."""
    rng = np.random.default_rng([1, case])
    size = int(10.0 ** (2.0 + 2.3 * rng.random()))
    scale, level = 0.1 + 4.0 * rng.random(), rng.random(size)
    laws = (
        scale * ndtri(level),
        -np.log(level) * scale / 4.0,
        np.where(rng.random(size) < 0.5, -np.inf, scale * ndtri(level)),
        -10.0 * scale * np.log(level) ** 2,
    )
    return np.asarray(laws[case % len(laws)])


def chains(case: int) -> np.ndarray:
    """Chains (chain, n) of autoregressive series, the last of some sets far from the others."""
    rng = np.random.default_rng([2, case])
    number, steps = int(rng.integers(2, 9)), int(10.0 ** (1.0 + 2.3 * rng.random()))
    memory = (-0.5, 0.0, 0.5, 0.9, 0.99)[case % 5]
    found = lfilter([1.0], [1.0, -memory], ndtri(rng.random((number, steps))), axis=1)
    found[-1] += case % 3
    return np.asarray(found)


def main() -> None:
    """Write what the installed ArviZ finds."""
    table = pd.read_csv(REFERENCE) if REFERENCE.exists() else pd.DataFrame({"case": range(CASES)})
    cases = range(CASES)
    if version("arviz").startswith("0."):
        import arviz

        smoothed = [arviz.psislw(log_ratios(case)) for case in cases]
        table["k_hat"] = [float(k_hat) for _, k_hat in smoothed]
        table["sum_of_squares"] = [float(np.exp(2.0 * weight).sum()) for weight, _ in smoothed]
        table["r_hat"] = [float(arviz.rhat(chains(case), method="rank")) for case in cases]
        table["effective_number"] = [float(arviz.ess(chains(case), method="mean")) for case in cases]
    else:
        from arviz_stats.base import array_stats

        # it takes the logarithms of likelihoods, whose negatives are those of ratios
        table["k_hat_of_arviz_stats"] = [float(array_stats.psislw(-log_ratios(case))[1]) for case in cases]
    table.to_csv(REFERENCE, index=False, float_format="%.10g", lineterminator="\n")


if __name__ == "__main__":
    sys.exit(main())
