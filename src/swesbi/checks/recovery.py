"""Recovery of known parameters by a network of features: its draws as rows of the table of calibration."""

from __future__ import annotations

import numpy as np
import pandas as pd

from swesbi.base.arrays import FloatArray
from swesbi.checks.settings import RecoverySettings
from swesbi.context import Context
from swesbi.heart.prior_simulations import PriorSimulations, draw_simulations
from swesbi.heart.settings import ForwardModelSettings
from swesbi.parameters import THETA_NAMES
from swesbi.prior import PriorSettings, in_bounds, prior_variance
from swesbi.seeds import integer_seed


class NothingRecoveredError(ValueError):
    """No synthetic recording has enough draws within the prior's bounds; the message says what to do."""


def fresh_simulations(
    count: int, context: Context, prior: PriorSettings, forward_model: ForwardModelSettings, seed: int
) -> PriorSimulations:
    """Simulate theta that no training has seen: the prior's draws under another root of the streams.

    Every kind of recovery uses the same theta, so their scores can be compared.
    """
    return draw_simulations(range(count), context, prior, forward_model, integer_seed(seed, "recovery"))


def recover(
    truth: FloatArray, candidates: FloatArray, prior: PriorSettings, settings: RecoverySettings
) -> pd.DataFrame:
    """Return a row a recording and parameter: truth, its level, and the moments of the posterior.

    Truths are (N, 3), unfiltered candidates (N, S, 3). A recording with fewer than ``min_in_prior_draws`` of
    them in the prior's bounds has no posterior that the study would report: it is left out, and the number of
    recordings scored says so. None left is a NothingRecoveredError. The level is the share of the draws in
    bounds below the truth, ties counted by half.
    """
    inside = [draws[in_bounds(draws, prior)] for draws in candidates]
    scored = [i for i, draws in enumerate(inside) if len(draws) >= settings.min_in_prior_draws]
    if not scored:
        raise NothingRecoveredError(
            f"none of the {len(truth)} synthetic recordings has {settings.min_in_prior_draws} draws in the "
            "prior's bounds: the estimator has not learned the posterior; train it longer"
        )
    kept, known = [inside[i] for i in scored], truth[scored]
    below = [(d < t).mean(axis=0) + 0.5 * (d == t).mean(axis=0) for d, t in zip(kept, known, strict=True)]
    columns = {
        "truth": known,
        "level": np.stack(below),
        "mean": np.stack([draws.mean(axis=0) for draws in kept]),
        "variance": np.stack([draws.var(axis=0, ddof=1) for draws in kept]),
        "prior_variance": np.tile(prior_variance(prior), (len(kept), 1)),
    }
    labels = {"number": np.repeat(scored, len(THETA_NAMES)), "quantity": [*THETA_NAMES] * len(scored)}
    return pd.DataFrame(labels | {name: values.ravel() for name, values in columns.items()})


def shares(total: int, parts: int) -> list[int]:
    """Share ``total`` recordings out over ``parts`` subjects as evenly as can be, the first getting more."""
    return [len(part) for part in np.array_split(np.arange(total), parts)]
