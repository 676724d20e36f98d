"""The generated parts of the documentation, each a text made of a finished study's numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

import pandas as pd

from swesbi.docs.epochs import epochs_part, width_part
from swesbi.docs.experiments import experiments_part, recovery_part
from swesbi.docs.numbers import fixed, mean_sd, share, table
from swesbi.docs.results import Results
from swesbi.parameters import THETA_NAMES
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
