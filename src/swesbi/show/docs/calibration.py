"""The generated parts of the page on an experiment on speeds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np
import pandas as pd

from swesbi.evaluation.check_names import ALARMS, ANSWERS, POOLED, RECORDINGS
from swesbi.evaluation.verdict import label_of_test, sampler_in_words, status
from swesbi.inference.posterior import interval_levels
from swesbi.show.docs.numbers import NONE, fixed, mean_sd, share, table
from swesbi.show.docs.results import CalibrationResults
from swesbi.speed_model.joint_prior import PHI_NAMES
from swesbi.theta import THETA_NAMES

Part = Callable[[CalibrationResults], str]
LEVEL: Final = 0.9


def answer_part(results: CalibrationResults) -> str:
    """Say in a few lines what came out."""
    found = [status(part) for part in results.supports.values()]
    counted = ", ".join(f"{found.count(name)} {name}" for name in dict.fromkeys(found))
    covered = results.scores[results.scores["supported"]]["coverage_phases"]
    phases = f"{share(covered.min(), 0)} to {share(covered.max(), 0)}" if len(covered) else NONE
    lines = [
        f"- Verdicts ({results.cohort_title}): {counted}.",
        f"- Coverage of the measured phases by {share(results.settings.predictive.interval, 0)} bands of new "
        f"recordings: {phases} over the subjects that are not unsupported.",
        f"- 90 % credible intervals cover, with own noise, {_covered(results.recovery)} of the true k_0, "
        f"k_ATP, k_SR; on recordings acquired sample by sample {_covered(results.recovery_acquisition)}.",
    ]
    if results.truth is not None and len(known := results.truth.dropna(subset="median")):
        inside = int((known["inside"].astype(str) == "True").sum())
        lines.append(f"- True parameters inside their 90 % intervals: {inside} of {len(known)}.")
    return "\n".join(lines)


def noise_part(results: CalibrationResults) -> str:
    """Show the noise components of the cohort."""
    rows = [
        {
            "noise of the speed": name,
            "size": share(part.fraction, 2),
            "standard error": share(part.standard_error, 2),
            f"{share(results.noise.interval, 0)} interval": f"{share(part.low, 2)} to {share(part.high, 2)}",
        }
        for name, part in (
            ("between repeats", results.noise.pooled.repeat),
            ("between samples of a repeat", results.noise.pooled.sample),
        )
    ]
    return (
        f"{table(rows)}\n\nFrom {results.noise.pooled.samples} accepted samples in "
        f"{results.noise.pooled.repeats} repeats; all recordings share the components: p = "
        f"{fixed(results.noise.homogeneity_p, 2)}."
    )


def discrepancy_part(results: CalibrationResults) -> str:
    """Show the evidence of the sizes of the discrepancy on the generated cohort."""
    if results.discrepancy is None:
        return "Not measured yet: `make discrepancy`."
    found = results.discrepancy.sort_values("log_evidence", ascending=False)
    chosen = pd.concat([found.head(5), found[(found["speed_fraction"] == 0) & (found["timing_cycle"] == 0)]])
    rows = [
        {
            "speed": share(row["speed_fraction"], 0),
            "timing (cycle)": share(row["timing_cycle"]),
            "log evidence": fixed(row["log_evidence"], 1),
            "below the best": f"{fixed(row['below_best'], 1)} ± {fixed(row['below_best_se'], 1)}",
        }
        | {f"coverage `{name}`": share(row[f"coverage_{name}"], 0) for name in THETA_NAMES}
        for row in chosen.to_dict("records")
    ]
    return f"{table(rows)}\n\n{int(found['subjects'].iloc[0])} generated subjects; the last row is without."


def flow_part(results: CalibrationResults) -> str:
    """Show what other architectures and numbers of simulations give."""
    if results.flow_choice is None:
        return "Not measured yet: `python benchmarks/flow_choice.py`."
    rows = [
        {
            "flow": f"{row['model']} {row['transforms']} x {row['hidden_features']}",
            "simulations a subject": str(row["simulations_per_subject"]),
            "training (s)": fixed(row["training_s"], 0),
            "held-out log-probability": fixed(row["log_probability"], 3),
            "median efficiency": share(row["efficiency_median"], 0),
        }
        for row in results.flow_choice.to_dict("records")
    ]
    return table(rows)


def verdict_part(results: CalibrationResults) -> str:
    """Show verdict, flagged tests and reliability of each subject."""
    rows = []
    for name in results.subjects:
        support, exact = results.supports[name], results.exact[name]
        flagged = [test for test in support.tests if test.flagged]
        against = ", ".join(
            label_of_test(test.name) + ("" if test.p_value is None else f" (p = {fixed(test.p_value, 4)})")
            for test in flagged
        )
        rows.append(
            {
                "subject": name,
                "verdict": status(support),
                "tests that speak against it": against or NONE,
                "draws by": sampler_in_words(support),
                "k-hat": fixed(exact.k_hat, 2),
                "efficiency": share(exact.efficiency, 0),
                "R-hat": fixed(exact.r_hat, 3),
            }
        )
    return table(rows)


def posterior_part(results: CalibrationResults) -> str:
    """Show medians and intervals of the exact posteriors."""
    mass = results.settings.exact.interval
    rows = []
    for name in results.subjects:
        phi = results.exact[name].phi
        ends = np.quantile(phi, interval_levels(mass), axis=0)
        row = {"subject": name, "verdict": status(results.supports[name])}
        for j, parameter in enumerate(PHI_NAMES):
            interval = f"[{fixed(ends[0, j], 2)}, {fixed(ends[1, j], 2)}]"
            row[f"`{parameter}`"] = f"{fixed(float(np.median(phi[:, j])), 2)} {interval}"
        rows.append(row)
    return f"{table(rows)}\n\nMedians and {share(mass, 0)} credible intervals."


def truth_part(results: CalibrationResults) -> str:
    """Show which intervals hold the truth of the generated recordings."""
    if results.truth is None:
        return "The cohort has no known true parameters."
    known = results.truth.dropna(subset="median")
    inside = known["inside"].astype(str) == "True"
    rows = []
    for name in dict.fromkeys(known["subject"]):
        own = known[known["subject"] == name].set_index("parameter")
        row = {"subject": name, "verdict": own["status"].iloc[0]}
        for parameter in THETA_NAMES:
            part = own.loc[parameter]
            mark = "" if str(part["inside"]) == "True" else " (outside)"
            interval = f"[{fixed(part['low'], 1)}, {fixed(part['high'], 1)}]"
            row[f"`{parameter}`"] = f"{fixed(part['truth'], 1)} in {interval}{mark}"
        rows.append(row)
    shown = f"\n\n{table(rows)}" if rows else ""
    return f"Inside: {int(inside.sum())} of {len(known)}.{shown}"


def scores_part(results: CalibrationResults) -> str:
    """Show predictive scores."""
    columns = {
        "RMSE prior (kPa)": ("rmse_prior_kpa", 2),
        "RMSE (kPa)": ("rmse_kpa", 2),
        "reduction (%)": ("rmse_reduction_percent", 1),
        "R2": ("r2", 3),
        "coverage, grid": ("coverage_grid", 2),
        "coverage, phases": ("coverage_phases", 2),
        "RMSE CMA-ES (kPa)": ("rmse_cmaes_kpa", 2),
    }
    rows = [
        {"subject": row["subject"]}
        | {title: fixed(row[name], digits) for title, (name, digits) in columns.items()}
        for row in results.scores.to_dict("records")
    ]
    supported = results.scores[results.scores["supported"]]
    mean = {title: mean_sd(supported[name], digits) for title, (name, digits) in columns.items()}
    return table([*rows, {"subject": "mean ± sd without the unsupported"} | mean])


def calibration_part(results: CalibrationResults) -> str:
    """Show how many checks of calibration fail, and what intervals cover."""
    checks = results.calibration[results.calibration["test"] != "c2st"]
    rows = []
    for (made, sampler), part in checks.groupby(["recordings", "sampler"], sort=False):
        pooled, single = part[part["subject"] == POOLED], part[part["subject"] != POOLED]
        rows.append(
            {
                "recordings": RECORDINGS.get(str(made), str(made)),
                "answer": ANSWERS.get(str(sampler), str(sampler)),
                "n": str(int(part["n"].max())),
                "checks that fail, pooled": _failed(pooled),
                "checks that fail, by subject": _failed(single),
            }
            | {f"`{name}` covered": _coverage_90(pooled, "sbc", name) for name in THETA_NAMES}
            | {"joint": _coverage_90(pooled, "tarp", "joint")}
        )
    return f"{table(rows)}\n\n{_two_samples(results.calibration)}"


def alarms_part(results: CalibrationResults) -> str:
    """Show false alarms and power of the verdict."""
    chosen = results.misspecification[results.misspecification["alarm"].isin(ALARMS)]
    rows = []
    for (subject, made), part in chosen.groupby(["subject", "recordings"], sort=False):
        rates = part.set_index("alarm")
        rows.append(
            {"subject": str(subject), "recordings": RECORDINGS.get(str(made), str(made))}
            | {name: _rate(rates, name) for name in ALARMS}
            | {"n": str(int(part["n"].iloc[0]))}
        )
    return table(rows)


def identifiability_part(results: CalibrationResults) -> str:
    """Show by how much each recording narrows each quantity."""
    found = results.identifiability
    rows = []
    for name in dict.fromkeys(found["subject"]):
        own = found[found["subject"] == name].set_index("quantity")
        row = {"subject": name}
        for quantity, part in own.iterrows():
            row[f"`{quantity}`"] = f"{fixed(part['contraction_log'], 2)}; {share(part['sd_log'], 0)}"
        rows.append(row)
    return f"{table(rows)}\n\nContraction of the logarithm; posterior standard deviation over the value."


def sensitivity_part(results: CalibrationResults) -> str:
    """Show how far other choices move medians, in widths of the intervals."""
    if results.sensitivity is None:
        return "Not measured yet: `make sensitivity`."
    rows = []
    for label, part in results.sensitivity.groupby("label", sort=False):
        moved = part.groupby("parameter")["shift_in_widths"].apply(lambda shifts: shifts.abs().max())
        width = part.groupby("parameter")["width_ratio"].median()
        rows.append(
            {"choice": str(label)}
            | {f"`{name}`": f"{fixed(moved[name], 2)}; {fixed(width[name], 2)}" for name in THETA_NAMES}
        )
    what = "Largest move of a median in widths of its interval; median ratio of the widths."
    return f"{table(rows)}\n\n{what}\n\n![Other choices](figures/sensitivity.png)"


def _covered(recovery: pd.DataFrame) -> str:
    at_level = recovery[np.isclose(recovery["nominal"], LEVEL)].set_index("parameter")
    return ", ".join(share(float(at_level["coverage"][name])) for name in THETA_NAMES)


def _failed(checks: pd.DataFrame) -> str:
    return f"{int(checks['flagged'].sum())} of {len(checks)}" if len(checks) else NONE


def _coverage_90(checks: pd.DataFrame, test: str, quantity: str) -> str:
    rows = checks[(checks["test"] == test) & (checks["quantity"] == quantity)]["coverage_90"].dropna()
    return share(float(rows.iloc[0])) if len(rows) else NONE


def _two_samples(calibration: pd.DataFrame) -> str:
    accuracies = calibration[calibration["test"] == "c2st"]
    if accuracies.empty:
        return "No samplers were compared."
    pairs = [
        f"{pair}: {fixed(part['statistic'].min(), 3)} to {fixed(part['statistic'].max(), 3)}"
        for pair, part in accuracies.groupby("sampler", sort=False)
    ]
    return f"Accuracy of a classifier that tells two samplers apart (0.5: it cannot), {'; '.join(pairs)}."


def _rate(rates: pd.DataFrame, alarm: str) -> str:
    if alarm not in rates.index:
        return NONE
    rate, low, high = (float(rates[name][alarm]) for name in ("rate", "ci_low", "ci_high"))
    return f"{share(rate)} ({100.0 * low:.1f} to {100.0 * high:.1f})"


PARTS: Final[Mapping[str, Part]] = {
    "answer": answer_part,
    "noise": noise_part,
    "discrepancy": discrepancy_part,
    "flow": flow_part,
    "verdicts": verdict_part,
    "posteriors": posterior_part,
    "truth": truth_part,
    "scores": scores_part,
    "calibration": calibration_part,
    "alarms": alarms_part,
    "identifiability": identifiability_part,
    "sensitivity": sensitivity_part,
}
