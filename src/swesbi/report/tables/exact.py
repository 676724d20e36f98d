"""An experiment on speeds: verdicts, tests, exact posteriors, identifiability, noise, calibration, alarms."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np
import pandas as pd

from swesbi.checks.calibration.table import ALARMS, C2ST, POOLED
from swesbi.checks.identifiability import SENSITIVE
from swesbi.draws import median_and_interval
from swesbi.parameters import OF_INTEREST, PHI_NAMES
from swesbi.recording.noise.cohort import GroupNoise
from swesbi.report.columns import each_parameter, named
from swesbi.report.numbers import MISSING, as_percent, count, fixed, significant
from swesbi.report.results import Experiment, columns_of, wide
from swesbi.report.table import Cell, Column, Strong, Table
from swesbi.verdict.summary import label_of_test
from swesbi.verdict.verdict import VerdictTest

KEYS: Final = ("subject", "parameter")
CLOPPER_PEARSON: Final = "Clopper-Pearson, as calibration.judgement.confidence says"


def verdicts_table(experiment: Experiment, cohort_title: str) -> Table:
    """Return the verdict of each subject, the tests behind it, and whether its sampler converged."""
    rows = [
        {
            "subject": subject,
            "status": verdict.status,
            "against": ", ".join(_flag(test) for test in verdict.tests if test.flagged) or MISSING,
            "sampler": verdict.sampler,
            "k_hat": result.k_hat,
            "efficiency": result.efficiency,
            "r_hat": result.largest_r_hat,
            "converged": result.converged,
        }
        for subject, verdict in experiment.verdicts.items()
        for result in [experiment.results[subject]]
    ]
    return Table(
        f"Verdict of each subject, and how its draws were made ({cohort_title}).",
        experiment.marked(pd.DataFrame(rows)),
        named("subject", "status", "against", "sampler", "k_hat", "efficiency", "r_hat", "converged"),
        "Draws come from the network, weighted with the exact likelihood; k-hat is the Pareto shape of the "
        "weights, efficiency their effective share. Where either fails, MCMC on the same likelihood answers, "
        "and R-hat compares its independent ensembles. A sampler that converged says nothing of the verdict: "
        "it has drawn from the posterior, whether or not the model can produce the recording.",
    )


def outcomes_table(experiment: Experiment, cohort_title: str) -> Table:
    """Return every test of every subject: its p-value, or the statistic where it has none."""
    frame = pd.DataFrame(
        {
            subject: {label_of_test(test.name): _outcome(test) for test in verdict.tests}
            for subject, verdict in experiment.verdicts.items()
        }
    )
    return Table(
        f"Can the model produce the recording? ({cohort_title})",
        frame.rename_axis("test").reset_index(),
        named("test", *(Column(subject, subject) for subject in experiment.verdicts)),
        "p-values against recordings that the model itself made of the same subject; where a test has no "
        "null distribution, its statistic. Bold: flagged.",
    )


def _outcome(test: VerdictTest) -> Cell:
    text = significant(test.statistic if test.p_value is None else test.p_value, 2)
    return Strong(text) if test.flagged else text


def _flag(test: VerdictTest) -> str:
    p = "" if test.p_value is None else f" (p = {fixed(test.p_value, 4)})"
    return f"{label_of_test(test.name)}{p}"


def exact_table(experiment: Experiment, cohort_title: str) -> Table:
    """Return the exact posterior of every subject beside the network's, the CMA-ES fit and a known truth."""
    frame, truth = pd.DataFrame(list(_answers(experiment))), experiment.truth
    names = ["subject", "parameter", "unit", "median", "interval", "network", "cmaes", "sampler", "status"]
    note = (
        f"{experiment.intervals} The posterior of a contradicted subject says where the model's best answer "
        "lies and is not to be read as that of the subject. Passive stiffness: a nuisance parameter, "
        "inferred with the others."
    )
    beside = [experiment.posterior[[*KEYS, "cmaes"]]]
    if len(truth):
        names[5:5] = ["truth", "inside"]
        beside.append(truth[[*KEYS, "truth", "inside"]])
        note += (
            " Where another model than this one made the recordings, its best parameters need not equal the "
            "truth. The discrepancy of the observation model is meant to cover the difference."
        )
    for table in beside:
        frame = frame.merge(table, how="left", on=list(KEYS))
    return Table(f"Exact posteriors ({cohort_title}).", experiment.marked(frame), named(*names), note)


def _answers(experiment: Experiment) -> Iterator[dict[str, object]]:
    for subject, verdict in experiment.verdicts.items():
        result = experiment.results[subject]
        told, drawn = result.phi[:, OF_INTEREST], result.proposal_phi[:, OF_INTEREST]
        limits = median_and_interval(told, experiment.credible_percent / 100.0)
        answers = zip(PHI_NAMES, *limits, np.median(drawn, axis=0), strict=True)
        for name, low, median, high, network in answers:
            yield {
                "subject": subject, "parameter": name, "median": median, "low": low, "high": high,
                "network": network, "sampler": verdict.sampler, "status": verdict.status,
            }  # fmt: skip


def identifiability_table(experiment: Experiment, cohort_title: str) -> Table:
    """Return how far the recording narrows each quantity, and what its posterior owes to what."""
    sensitivities = ("sensitivity_prior", "sensitivity_nuisances", "sensitivity_likelihood")
    widths = ("sd_log", "expected_sd_log", "width_4")
    return Table(
        f"What a recording tells ({cohort_title}).",
        experiment.identifiability,
        named("subject", "quantity", "contraction_log", *sensitivities, *widths, "correlated"),
        "Contraction: 1 − posterior variance / prior variance of the logarithm. Sensitivity: how far the "
        "posterior moves for each doubling of the power of its prior or its likelihood. From "
        f"{SENSITIVE:g} on it depends on that; where it depends on both, they disagree. Expected: by the "
        "information of the phases.",
    )


def noise_table(experiment: Experiment, cohort_title: str) -> Table:
    """Return the noise components, and the discrepancy that stands beside them."""
    if experiment.noise is None:
        raise ValueError(f"the experiment {experiment.name!r} has no noise of the speeds")
    groups = experiment.noise.groups
    discrepancy = experiment.settings["observation_model"]["discrepancy"]
    rows = [
        {"component": f"between {name}s{_of_group(group, groups)}", **vars(part)}
        for group, noise in groups.items()
        for name, part in noise.pooled.parts.items()
    ]
    for name, key in (("in speed", "speed_fraction"), ("in timing, % of the cycle", "timing_cycle")):
        rows.append({"component": f"model discrepancy {name}", "fraction": discrepancy[key]})
    of_group = " ".join(
        f"From {count(noise.pooled.samples)} samples in {count(noise.pooled.repeats)} repeats"
        f"{_of_group(group, groups)}; the same in all these recordings: p = {noise.homogeneity_p:.2g}."
        for group, noise in groups.items()
    )
    return Table(
        f"Noise of the measured speeds ({cohort_title}).",
        pd.DataFrame(rows),
        named("component", "fraction", "standard_error", "size_interval"),
        f"Noise by restricted maximum likelihood. {of_group} Intervals: "
        f"{as_percent(experiment.noise.interval)}. The discrepancy is a setting of the experiment: "
        "observation_model.discrepancy.",
    )


def _of_group(name: str, groups: Mapping[str, GroupNoise]) -> str:
    """Return which recordings are meant, where a cohort has several groups."""
    return "" if len(groups) == 1 else f", {name} ({', '.join(groups[name].by_subject)})"


def calibration_summary(exact: Experiment) -> Table:
    """Return how many checks of calibration fail, by how recordings were made and who answered."""
    table = exact.calibration
    rows = []
    for key, part in table[table["test"] != C2ST].groupby(["recordings", "sampler"], sort=False):
        of_all = part["subject"] == POOLED
        known = part[of_all].dropna(subset="coverage_90")
        covered = dict(zip(known["test"] + " " + known["quantity"], known["coverage_90"], strict=True))
        failed = {"pooled": _failed(part[of_all]), "single": _failed(part[~of_all]), "n": part["n"].max()}
        rows.append(dict(zip(("recordings", "sampler"), key, strict=True)) | failed | covered)
    return Table(
        "Calibration on recordings of known parameters.",
        pd.DataFrame(rows),
        named("recordings", "answer", "pooled", "single", *each_parameter("sbc"), "tarp joint", "n"),
        "Checks: ranks of the truth and coverage at all levels within simultaneous bands, joint coverage, "
        "contraction. Coverage is that of 90 % intervals and regions. At the subject's own data, the truth "
        f"is a draw of its posterior and the recording a new one from it. {two_samples(table)}",
    )


def _failed(table: pd.DataFrame) -> str:
    return f"{int(table['flagged'].sum())} of {len(table)}" if len(table) else MISSING


def failed_checks(exact: Experiment) -> Table:
    """Return the checks that failed."""
    table, of_each = exact.calibration, ("checked", "statistic", "p_value", "limit")
    return Table(
        "Checks of calibration that failed.",
        table[table["flagged"] == 1],
        named("subject", "recordings", "answer", "test", "quantity", *of_each),
        f"All {count(len(table))} checks: calibration.csv in the folder of the experiment.",
    )


def alarms_table(exact: Experiment) -> Table:
    """Return how often the verdict raises an alarm on recordings that the model itself made."""
    alarms = (
        Column(columns_of(name, ("rate", "ci_low", "ci_high")), name, "% (interval)", "1%") for name in ALARMS
    )
    frame = wide(exact.alarms[exact.alarms["alarm"].isin(ALARMS)], ["recordings"], "alarm")
    return Table(
        "False alarms of the misspecification tests.",
        frame,
        named("recordings", *alarms, "n"),
        f"On recordings that the model itself made an alarm is false. Intervals: {CLOPPER_PEARSON}.",
    )


def two_samples(calibration: pd.DataFrame) -> str:
    """Say how well a classifier tells samplers apart."""
    accuracies = calibration[calibration["test"] == C2ST]
    if accuracies.empty:
        return "No samplers were compared."
    pairs = [
        f"{pair}: {fixed(part['statistic'].min(), 3)} to {fixed(part['statistic'].max(), 3)}"
        for pair, part in accuracies.groupby("sampler", sort=False)
    ]
    return f"Accuracy of a classifier that tells two samplers apart (0.5: it cannot), {'; '.join(pairs)}."
