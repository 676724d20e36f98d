"""What answers to pairs of recordings come to: coverage, false change, power, flags by distance.

Pure functions of rows as ``change_pairs.py`` keeps them, one of each quantity of each pair.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri
from scipy.stats import binomtest

from swesbi.persons.change.ratios import QUANTITIES
from swesbi.persons.change.settings import ChangeRuleSettings

FloatArray = NDArray[np.float64]
CONFIDENCE: Final = 0.95  # of the Clopper-Pearson interval on each share
DISTANCE_EDGES_SD: Final = (0.0, 1.0, 2.0, 3.0, 4.0, 6.0, np.inf)
FAR_SD: Final = 3.0
PAIR: Final = ["shares", "variant", "number"]


def share(hits: pd.Series, name: str) -> dict[str, float]:
    """Return how many of so many, as a share with its Clopper-Pearson interval; NaN of none."""
    counted, n = int(hits.sum()), len(hits)
    if not n:
        return {f"{name}_n": 0, f"{name}_1": np.nan, f"{name}_low_1": np.nan, f"{name}_high_1": np.nan}
    interval = binomtest(counted, n).proportion_ci(CONFIDENCE, method="exact")
    return {
        f"{name}_n": n,
        f"{name}_1": counted / n,
        f"{name}_low_1": float(interval.low),
        f"{name}_high_1": float(interval.high),
    }


def direction(rows: pd.DataFrame, rule: ChangeRuleSettings) -> FloatArray:
    """Return +1 where a rise is called, -1 where a fall is, 0 where nothing; shape (n,)."""
    rises = rows["risen_1"].to_numpy() > rule.probability
    falls = rows["fallen_1"].to_numpy() > rule.probability
    return np.asarray(rises.astype(float) - falls.astype(float))


def promised_power(log_ratio: FloatArray, sd_log: FloatArray, rule: ChangeRuleSettings) -> FloatArray:
    """Return the probability with which a true log ratio is called, by the width of its posterior.

    As the smallest detectable change has it (``persons.change.ratios``): Phi((|D| - log(1 + t)) / s - z_P).
    """
    return np.asarray(ndtr((np.abs(log_ratio) - np.log1p(rule.threshold)) / sd_log - ndtri(rule.probability)))


def rates(rows: pd.DataFrame, rule: ChangeRuleSettings) -> pd.DataFrame:
    """Return a row for each setting of the shares, variant and quantity.

    Coverage is of all answered pairs, and again of those with neither visit contradicted or strained, if they
    were judged.
    False change is asked of what was left as it was, and lies within the threshold by the truth; power, and
    the power that widths promise, of what truly changed by more. A call in the wrong direction is a miss.

    Args:
        rows: Of true pairs, failed ones among them.
        rule: When a change counts.
    """
    found = [
        _of_quantity(part, rule) | {"failed_pairs": failed}
        for _, of_variant in rows.groupby(["shares", "variant"], sort=False)
        for failed in [int((of_variant["failure"] != "").sum())]
        for _, part in of_variant[of_variant["failure"] == ""].groupby("quantity", sort=False)
        if part["quantity"].iloc[0] in QUANTITIES
    ]
    return pd.DataFrame(found)


def _of_quantity(part: pd.DataFrame, rule: ChangeRuleSettings) -> dict[str, object]:
    true, called = part["true_log_ratio"].to_numpy(), direction(part, rule)
    covered = (part["true_log_ratio"] >= part["low_log"]) & (part["true_log_ratio"] <= part["high_log"])
    beyond = np.abs(true) > np.log1p(rule.threshold)
    left = part["left_alone"].to_numpy(dtype=bool) & ~beyond
    width = (part["high_log"] - part["low_log"]).to_numpy()
    judged = part["not_contradicted"].isin(["yes", "no"]).all()
    not_contradicted = (part["not_contradicted"] == "yes").to_numpy()
    promised = promised_power(true, part["sd_log"].to_numpy(), rule)[beyond]
    return {
        **{name: part[name].iloc[0] for name in ("shares", "variant", "quantity")},
        "pairs": len(part),
        "pairs_not_contradicted": int(not_contradicted.sum()) if judged else None,
        **share(covered, "coverage_90"),
        **share(covered[not_contradicted], "coverage_90_not_contradicted"),
        "width_log": float(np.median(width)),
        "narrower_1": float(part["narrowing_1"].median()),
        "median_bias_log": float(np.median(part["median_log"] - true)),
        **share(pd.Series(called[left] != 0.0), "false_change"),
        **share(pd.Series(called[beyond] == np.sign(true[beyond])), "power"),
        "promised_power_1": float(promised.mean()) if len(promised) else np.nan,
        "efficiency_1": float(part["efficiency_1"].median()),
        "by_mcmc_1": float((part["sampler"] == "mcmc").mean()),
        "converged_1": float(part["converged"].astype(bool).mean()),
        "seconds_a_pair": float(_seconds(part).sum(axis=1).mean()),
    }


def _seconds(rows: pd.DataFrame) -> pd.DataFrame:
    return rows[[name for name in rows.columns if name.endswith("_s") and name.startswith("cost_")]]


def one_row_a_pair(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the pairs that were answered, a row each."""
    return rows[rows["failure"] == ""].drop_duplicates(PAIR)


def flags(pairs: pd.DataFrame, level: float) -> pd.DataFrame:
    """Return how often a pair is taken for two persons, by its distance where it is of strangers.

    Args:
        pairs: A row each.
        level: Of the test.
    """
    table = [
        {"shares": shares, "variant": variant, "distance": by, "from_sd": low, "to_sd": high}
        | share(part["p_value_1"] <= level, "flagged")
        for (shares, variant), of_variant in pairs.groupby(["shares", "variant"], sort=False)
        for by, low, high, part in _by_distance(of_variant)
    ]
    return pd.DataFrame(table)


def _by_distance(pairs: pd.DataFrame) -> Iterator[tuple[str, float, float, pd.DataFrame]]:
    """Yield all pairs, and those of strangers in bins of the found and of the true distance."""
    yield "any", 0.0, np.inf, pairs
    if pairs["variant"].iloc[0] != "strangers":
        return
    bins = [*zip(DISTANCE_EDGES_SD[:-1], DISTANCE_EDGES_SD[1:], strict=True), (FAR_SD, np.inf)]
    for by in ("found", "true"):
        distance = pairs[f"{by}_distance_sd"]
        for low, high in bins:
            yield by, low, high, pairs[(distance >= low) & (distance < high)]


def costs(rows: pd.DataFrame) -> pd.DataFrame:
    """Return mean seconds of one core of each part of a pair, by variant.

    The part of the first visit is what it took over the number of variants that it was made for.
    """
    pairs = one_row_a_pair(rows)
    seconds = _seconds(pairs).assign(shares=pairs["shares"], variant=pairs["variant"])
    return seconds.groupby(["shares", "variant"], sort=False).mean().reset_index()
