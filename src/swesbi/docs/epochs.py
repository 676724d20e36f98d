"""The generated parts on the epochs of training."""

from __future__ import annotations

import pandas as pd

from swesbi.docs.numbers import fixed, share, table
from swesbi.docs.results import Results
from swesbi.parameters import THETA_NAMES
from swesbi.tables.epochs import (
    COVERAGE_PHASES,
    FRESH_LOSS,
    RECOVERY_COVERAGE,
    RELATIVE_SD,
    RMSE,
    VALIDATION_LOSS,
)


def epochs_part(results: Results) -> str:
    """Show loss, recovery, observed coverage, error and width at each checkpoint."""
    return table([_row(results, epoch) for epoch in sorted(set(results.epochs["epoch"]))])


def _row(results: Results, epoch: int) -> dict[str, str]:
    at = results.epochs[results.epochs["epoch"] == epoch]
    recovery = _of(at, RECOVERY_COVERAGE).set_index("parameter")["value"]
    widths = _supported(results, at, RELATIVE_SD).groupby("parameter")["value"].median()
    best = " (best)" if at["best"].any() else ""
    return {
        "epoch": f"{epoch}{best}",
        "validation loss": fixed(_of(at, VALIDATION_LOSS)["value"].iloc[0], 2),
        "loss of parameters never seen": fixed(_of(at, FRESH_LOSS)["value"].iloc[0], 2),
        "recovery of k_0, k_ATP, k_SR": ", ".join(share(recovery[name]) for name in THETA_NAMES),
        "phases in the predictive interval": _range(_supported(results, at, COVERAGE_PHASES), 100.0, 0, " %"),
        "RMSE (kPa)": _range(_supported(results, at, RMSE), 1.0, 2),
        "sd / prior sd of k_0, k_ATP, k_SR": ", ".join(
            share(widths.get(name, float("nan")), 2) for name in THETA_NAMES
        ),
    }


def width_part(results: Results) -> str:
    """Say in a sentence how far the posteriors shrink between the first and the best epoch."""
    earliest, reached = int(results.epochs["epoch"].min()), _best_epoch(results)
    first, best = (_median_width(results, epoch) for epoch in (earliest, reached))
    factors = ", ".join(f"{fixed(first[name] / best[name], 0)} for `{name}`" for name in THETA_NAMES)
    now = ", ".join(f"{share(best[name], 2)} for `{name}`" for name in THETA_NAMES)
    return (
        f"From epoch {earliest} to the best one, {reached}, the posteriors of the supported subjects narrow "
        f"by a factor of {factors} (medians over subjects), to {now}, relative to the prior's standard "
        "deviation."
    )


def _best_epoch(results: Results) -> int:
    return int(results.epochs["epoch"][results.epochs["best"] == 1].iloc[0])


def _median_width(results: Results, epoch: int) -> pd.Series:
    at = results.epochs[results.epochs["epoch"] == epoch]
    widths = _supported(results, at, RELATIVE_SD).groupby("parameter")["value"].median()
    return widths.reindex(list(THETA_NAMES))


def _of(rows: pd.DataFrame, quantity: str) -> pd.DataFrame:
    return rows[rows["quantity"] == quantity]


def _supported(results: Results, rows: pd.DataFrame, quantity: str) -> pd.DataFrame:
    return _of(rows[rows["subject"].isin(results.supported)], quantity)


def _range(rows: pd.DataFrame, scale: float, decimals: int, unit: str = "") -> str:
    """Return the least and the greatest value over the subjects."""
    low, high = (fixed(scale * value, decimals) for value in (rows["value"].min(), rows["value"].max()))
    return f"{low}{unit}" if low == high else f"{low} to {high}{unit}"
