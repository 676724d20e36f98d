"""The generated parts of the page on what reproduces, each a text made of a finished study's numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

import pandas as pd

from swesbi.parameters import THETA_NAMES
from swesbi.report import training_tables
from swesbi.report.numbers import fixed, share
from swesbi.report.table import Table, markdown
from swesbi.report.tables import experiments
from swesbi.report.tables.subjects import score_table, verdict_table
from tools.docs.results import ReproductionResults
from tools.docs.statements import statements_part


def support_part(results: ReproductionResults) -> str:
    """Show both criteria of prior support, subject by subject."""
    count = f"{len(results.supported)} of {len(results.subjects)}"
    shown = markdown(verdict_table(results.main, results.cohort_title))
    return f"Prior-supported: {count} ({results.cohort_title}, experiment `{results.main.name}`).\n\n{shown}"


def scores_part(results: ReproductionResults) -> str:
    """Show table 1: the scores of the subjects, and mean and standard deviation over those that pass."""
    return markdown(score_table(results.main, results.cohort_title))


def recovery_part(results: ReproductionResults) -> str:
    """Show what credible intervals cover, under the own observation model and on recordings."""
    return markdown(experiments.recovery_table([results.main]))


def truth_part(results: ReproductionResults) -> str:
    """Set medians and 90 % intervals of prior-supported subjects beside the theta of their recordings."""
    if not results.true_theta:
        return "The cohort has no known true parameters."
    chosen = results.main.posterior
    rows, inside = [], 0
    for name in results.supported:
        row = {"subject": name}
        for j, parameter in enumerate(THETA_NAMES):
            summary = chosen[(chosen["subject"] == name) & (chosen["parameter"] == parameter)].iloc[0]
            true, low, high = results.true_theta[name][j], summary["ci_low"], summary["ci_high"]
            inside += int(low <= true <= high)
            row[f"`{parameter}` true"] = fixed(true, 1)
            interval = f"[{fixed(low, 2)}, {fixed(high, 2)}]"
            row[f"`{parameter}` inferred"] = f"{fixed(summary['median'], 2)} {interval}"
        rows.append(row)
    if not rows:
        return "The prior supports no subject."
    total = len(rows) * len(THETA_NAMES)
    shown = markdown(Table("", pd.DataFrame(rows)))
    return f"True parameters inside their 90 % credible intervals: {inside} of {total}.\n\n{shown}"


def epochs_part(results: ReproductionResults) -> str:
    """Show loss, recovery, observed coverage, error and width at the first, best and last checkpoint."""
    epochs = results.epochs["epoch"]
    shown = sorted({int(epochs.min()), _best_epoch(results), int(epochs.max())})
    rows = pd.DataFrame([_row(results, epoch) for epoch in shown])
    return f"{markdown(Table('', rows))}\n\n{_narrowed(results)}"


def _row(results: ReproductionResults, epoch: int) -> dict[str, str]:
    at = results.epochs[results.epochs["epoch"] == epoch]
    recovery = _of(at, training_tables.RECOVERY_COVERAGE).set_index("parameter")["value"]
    widths = _supported(results, at, training_tables.RELATIVE_SD).groupby("parameter")["value"].median()
    best = " (best)" if at["best"].any() else ""
    return {
        "epoch": f"{epoch}{best}",
        "validation loss": fixed(_of(at, training_tables.VALIDATION_LOSS)["value"].iloc[0], 2),
        "loss of parameters never seen": fixed(_of(at, training_tables.FRESH_LOSS)["value"].iloc[0], 2),
        "recovery of k_0, k_ATP, k_SR": ", ".join(share(recovery[name]) for name in THETA_NAMES),
        "phases in the band of noiseless curves": _range(
            _supported(results, at, training_tables.COVERAGE_PHASES), 100.0, 0, " %"
        ),
        "RMSE (kPa)": _range(_supported(results, at, training_tables.RMSE), 1.0, 2),
        "sd / prior sd of k_0, k_ATP, k_SR": ", ".join(
            share(widths.get(name, float("nan")), 2) for name in THETA_NAMES
        ),
    }


def _narrowed(results: ReproductionResults) -> str:
    """Say in a sentence how far the posteriors shrink between the first and the best epoch."""
    earliest, reached = int(results.epochs["epoch"].min()), _best_epoch(results)
    first, best = (_median_width(results, epoch) for epoch in (earliest, reached))
    factors = ", ".join(f"{fixed(first[name] / best[name], 0)} for `{name}`" for name in THETA_NAMES)
    now = ", ".join(f"{share(best[name], 2)} for `{name}`" for name in THETA_NAMES)
    return (
        f"From epoch {earliest} to the best one, {reached}, the posteriors of the prior-supported "
        f"subjects narrow by a factor of {factors} (medians over subjects), to {now}, relative to the "
        "prior's standard deviation."
    )


def _best_epoch(results: ReproductionResults) -> int:
    return int(results.epochs["epoch"][results.epochs["best"] == 1].iloc[0])


def _median_width(results: ReproductionResults, epoch: int) -> pd.Series:
    at = results.epochs[results.epochs["epoch"] == epoch]
    widths = _supported(results, at, training_tables.RELATIVE_SD).groupby("parameter")["value"].median()
    return widths.reindex(list(THETA_NAMES))


def _of(rows: pd.DataFrame, quantity: str) -> pd.DataFrame:
    return rows[rows["quantity"] == quantity]


def _supported(results: ReproductionResults, rows: pd.DataFrame, quantity: str) -> pd.DataFrame:
    return _of(rows[rows["subject"].isin(results.supported)], quantity)


def _range(rows: pd.DataFrame, scale: float, decimals: int, unit: str = "") -> str:
    """Return the least and the greatest value over the subjects."""
    low, high = (fixed(scale * value, decimals) for value in (rows["value"].min(), rows["value"].max()))
    return f"{low}{unit}" if low == high else f"{low} to {high}{unit}"


PARTS: Final[Mapping[str, Callable[[ReproductionResults], str]]] = {
    "statements": statements_part,
    "support": support_part,
    "scores": scores_part,
    "epochs": epochs_part,
    "recovery": recovery_part,
    "truth": truth_part,
}
