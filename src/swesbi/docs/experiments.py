"""The generated parts on the experiments beside each other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
import pandas as pd

from swesbi.docs.numbers import fixed, mean_sd, share, table
from swesbi.docs.results import Results
from swesbi.parameters import THETA_NAMES

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
