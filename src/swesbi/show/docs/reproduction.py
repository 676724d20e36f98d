"""The generated parts on the epochs of training."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np
import pandas as pd

from swesbi.show.docs.numbers import fixed, mean_sd, share, table
from swesbi.show.docs.results import Results
from swesbi.show.training_tables import (
    COVERAGE_PHASES,
    FRESH_LOSS,
    RECOVERY_COVERAGE,
    RELATIVE_SD,
    RMSE,
    VALIDATION_LOSS,
)
from swesbi.theta import THETA_NAMES
from swesbi.virtual_cohort.readme import markdown

Part = Callable[[Results], str]


def run_part(results: Results) -> str:
    """Say what was run."""
    lines = []
    for name in results.experiments:
        history = results.training[name]
        best = history.iloc[int(history["validation_loss"].argmin())]
        lines.append(
            {
                "experiment": f"`{name}`",
                "epochs run": str(len(history)),
                "best epoch": str(int(best["epoch"])),
                "its validation loss": fixed(best["validation_loss"], 2),
                "loss of the last epoch": fixed(history["validation_loss"].iloc[-1], 2),
            }
        )
    return table(lines)


def support_part(results: Results) -> str:
    """Show both criteria of prior support, subject by subject."""
    rows = []
    for name in results.subjects:
        support = results.supports[name]
        rows.append(
            {
                "subject": name,
                "max abs z": fixed(support.max_abs_z, 2),
                "of the component": f"`{support.worst_component}`",
                "draws in the prior's bounds": share(support.acceptance),
                "unfiltered median of k_ATP (1/s)": fixed(support.unfiltered_median["k_atp_per_s"], 1),
                "supported": "yes" if support.supported else "no",
            }
        )
    count = f"{len(results.supported)} of {len(results.subjects)}"
    return f"Supported: {count} ({results.cohort_title}, experiment `{results.main}`).\n\n{table(rows)}"


def scores_part(results: Results) -> str:
    """Show table 1: the scores of the supported subjects, and their mean and standard deviation."""
    scores = results.scores[(results.scores["experiment"] == results.main) & results.scores["supported"]]
    columns: Mapping[str, tuple[str, int]] = {
        "RMSE prior (kPa)": ("rmse_prior_kpa", 2),
        "RMSE SBI (kPa)": ("rmse_kpa", 2),
        "reduction (%)": ("rmse_reduction_percent", 1),
        "NRMSE": ("nrmse", 3),
        "R2": ("r2", 3),
        "post-peak RMSE (kPa)": ("post_peak_rmse_kpa", 2),
        "coverage, grid": ("coverage_grid", 2),
        "coverage, phases": ("coverage_phases", 2),
        "RMSE CMA-ES (kPa)": ("rmse_cmaes_kpa", 2),
    }
    rows = [
        {"subject": row["subject"]}
        | {title: fixed(row[name], digits) for title, (name, digits) in columns.items()}
        for _, row in scores.iterrows()
    ]
    mean = {title: mean_sd(scores[name], digits) for title, (name, digits) in columns.items()}
    return table([*rows, {"subject": "mean ± sd"} | mean])


def truth_part(results: Results) -> str:
    """Set medians and 90 % intervals of the supported subjects beside the theta that made the recordings."""
    if not results.true_theta:
        return "The cohort has no known true parameters."
    chosen = results.posterior[results.posterior["experiment"] == results.main]
    rows, inside = [], 0
    for name in results.supported:
        row = {"subject": name}
        for j, parameter in enumerate(THETA_NAMES):
            found = chosen[(chosen["subject"] == name) & (chosen["parameter"] == parameter)].iloc[0]
            true, low, high = results.true_theta[name][j], found["ci_low"], found["ci_high"]
            inside += int(low <= true <= high)
            row[f"`{parameter}` true"] = fixed(true, 1)
            interval = f"[{fixed(low, 2)}, {fixed(high, 2)}]"
            row[f"`{parameter}` inferred"] = f"{fixed(found['median'], 2)} {interval}"
        rows.append(row)
    if not rows:
        return "The prior supports no subject."
    total = len(rows) * len(THETA_NAMES)
    return f"True parameters inside their 90 % credible intervals: {inside} of {total}.\n\n{table(rows)}"


def correlation_part(results: Results) -> str:
    """Show the posterior correlations of the supported subjects."""
    chosen = results.posterior[
        (results.posterior["experiment"] == results.main)
        & (results.posterior["parameter"].isin(THETA_NAMES))
        & results.posterior["subject"].isin(results.supported)
    ]
    pairs = ((0, 1), (0, 2), (1, 2))
    titles = {pair: f"`{THETA_NAMES[pair[0]]}`, `{THETA_NAMES[pair[1]]}`" for pair in pairs}
    values: dict[tuple[int, int], pd.Series] = {
        (i, j): chosen[chosen["parameter"] == THETA_NAMES[i]].set_index("subject")[
            f"correlation_{THETA_NAMES[j]}"
        ]
        for i, j in pairs
    }
    rows = [
        {"subject": name} | {titles[pair]: fixed(values[pair][name], 2) for pair in pairs}
        for name in results.supported
    ]
    mean = {titles[pair]: mean_sd(values[pair], 2) for pair in pairs}
    return table([*rows, {"subject": "mean ± sd"} | mean])


def comparison_part(results: Results) -> str:
    """Show every number of the paper beside this study's, folded."""
    shown = results.comparison.map(lambda text: text.replace("|", "\\|"))
    body = markdown(shown)
    summary = f"<summary>All {len(shown)} numbers</summary>"
    return f"<details>\n{summary}\n\n{body}\n\n</details>"


LEVEL: Final = 0.9
PAPER_RECOVERY: Final = dict(zip(THETA_NAMES, ("92.5 %", "90.5 %", "26.5 %"), strict=True))


def recovery_part(results: Results) -> str:
    """Show what 90 % credible intervals cover, under the own observation model and on recordings."""
    rows = []
    for experiment in results.experiments:
        kinds = {
            "own observation model": results.recovery[experiment],
            "recordings, passive scale redone": results.recovery_acquisition[experiment],
        }
        for kind, scores in kinds.items():
            at_level = scores[np.isclose(scores["nominal"], LEVEL)].set_index("parameter")
            rows.append(
                {"experiment": f"`{experiment}`", "synthetic recordings": kind}
                | {f"`{name}`": _coverage(at_level, name) for name in THETA_NAMES}
                | {"scored": str(int(at_level["n"].iloc[0]))}
            )
    paper = {"experiment": "the paper", "synthetic recordings": "own observation model"}
    return table(
        [*rows, paper | {f"`{name}`": PAPER_RECOVERY[name] for name in THETA_NAMES} | {"scored": "400"}]
    )


def experiments_part(results: Results) -> str:
    """Show support, fit, coverage and the medians of k_ATP of each experiment."""
    rows = []
    for experiment in results.experiments:
        own = results.scores[results.scores["experiment"] == experiment]
        supported = own[own["supported"]]
        k_atp = _medians(results.posterior, experiment, "k_atp_per_s")
        rows.append(
            {
                "experiment": f"`{experiment}`",
                "supported": ", ".join(supported["subject"]) or "none",
                "RMSE (kPa)": mean_sd(supported["rmse_kpa"], 2),
                "reduction (%)": mean_sd(supported["rmse_reduction_percent"], 1),
                "coverage, phases": mean_sd(supported["coverage_phases"], 2),
                "median k_ATP (1/s)": ", ".join(f"{name} {fixed(k_atp[name], 2)}" for name in k_atp) or "–",
            }
        )
    return f"{table(rows)}\n\n{_shared(results)}"


def _shared(results: Results) -> str:
    """Show errors on the subjects that every experiment supports, where recordings are the same."""
    sets = [
        set(own["subject"][own["supported"]]) for _, own in results.scores.groupby("experiment", sort=False)
    ]
    common = [name for name in results.subjects if all(name in one for one in sets)]
    if not common:
        return "No subject is supported under every experiment."
    errors = []
    for experiment in results.experiments:
        own = results.scores[results.scores["experiment"] == experiment].set_index("subject")
        errors.append(f"`{experiment}` {mean_sd(own.loc[common, 'rmse_kpa'], 2)} kPa")
    return (
        f"RMSE over the subjects that every experiment supports ({', '.join(common)}): {'; '.join(errors)}."
    )


def _medians(posterior: pd.DataFrame, experiment: str, parameter: str) -> Mapping[str, float]:
    chosen = posterior[(posterior["experiment"] == experiment) & (posterior["parameter"] == parameter)]
    known = chosen.dropna(subset=["median"])
    return dict(zip(known["subject"], known["median"], strict=True))


def _coverage(rows: pd.DataFrame, parameter: str) -> str:
    coverage, low, high = (float(rows[name][parameter]) for name in ("coverage", "ci_low", "ci_high"))
    return f"{share(coverage)} ({100.0 * low:.1f} to {100.0 * high:.1f})"


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


PARTS: Final[Mapping[str, Part]] = {
    "run": run_part,
    "support": support_part,
    "scores": scores_part,
    "truth": truth_part,
    "correlations": correlation_part,
    "recovery": recovery_part,
    "epochs": epochs_part,
    "width": width_part,
    "experiments": experiments_part,
    "comparison": comparison_part,
}
