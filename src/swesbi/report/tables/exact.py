"""An experiment on speeds: verdicts and their tests, exact posteriors, truth, identifiability, noise."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pandas as pd

from swesbi.draws import interval_levels
from swesbi.parameters import PHI_NAMES
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.noise import CohortNoise
from swesbi.report.numbers import (
    MISSING,
    PARAMETER_UNITS,
    PARAMETERS,
    as_percent,
    count,
    estimate,
    fixed,
    percent,
    quantity,
    significant,
    span,
)
from swesbi.report.results import Experiment, is_true, records
from swesbi.report.table import Cell, Column, Row, Strong, Table, words
from swesbi.verdict.answers import label_of_test, sampler_in_words
from swesbi.verdict.verdict import STRAINED, Verdict, VerdictTest

PASSIVE: Final = "passive_stiffness_kpa"
SYMBOLS: Final = {**PARAMETERS, PASSIVE: "passive stiffness a"}
UNITS: Final = {**PARAMETER_UNITS, PASSIVE: "kPa"}


@dataclass(frozen=True)
class Exact:
    """What only an experiment on speeds has.

    Attributes:
        experiment: What every experiment has.
        results: Exact posterior of each subject.
        calibration: ``calibration.csv``.
        misspecification: ``misspecification.csv``.
        identifiability: ``identifiability.csv``.
        noise: The cohort's noise.
        truth: Its rows of ``truth.csv``; empty for a cohort without known truth.
    """

    experiment: Experiment
    results: Mapping[str, ExactPosterior]
    calibration: pd.DataFrame
    misspecification: pd.DataFrame
    identifiability: pd.DataFrame
    noise: CohortNoise
    truth: pd.DataFrame

    @property
    def verdicts(self) -> Mapping[str, Verdict]:
        """Verdict of each subject."""
        return self.experiment.verdicts


def verdicts_table(exact: Exact, cohort_title: str) -> Table:
    """Return the verdict of each subject, the tests behind it, and whether its sampler converged."""
    columns = (
        *words("Subject", "Verdict", "Tests that speak against it", "Draws by"),
        Column("k-hat"),
        Column("Efficiency", "%"),
        Column("R-hat"),
        *words("Sampler converged"),
    )
    rows = []
    for subject, verdict in exact.verdicts.items():
        result = exact.results[subject]
        flagged = ", ".join(_flag(test) for test in verdict.tests if test.flagged)
        cells = (
            subject,
            verdict.status,
            flagged or MISSING,
            sampler_in_words(verdict),
            fixed(result.k_hat, 2) if math.isfinite(result.k_hat) else "inf",
            percent(result.efficiency, 0),
            fixed(result.largest_r_hat, 3),
            "yes" if result.converged else "no",
        )
        rows.append(Row(cells, muted=not verdict.may_be_read, strained=verdict.status == STRAINED))
    note = (
        "Draws come from the network, weighted with the exact likelihood; k-hat is the Pareto shape of the "
        "weights, efficiency their effective share. Where either fails, MCMC on the same likelihood answers, "
        "and R-hat compares its independent ensembles. A sampler that converged says nothing of the verdict: "
        "it has drawn from the posterior, whether or not the model can have made the recording."
    )
    return Table(
        f"Verdict of each subject, and how its draws were made ({cohort_title}).", columns, tuple(rows), note
    )


def outcomes_table(exact: Exact, cohort_title: str) -> Table:
    """Return every test of every subject: its p-value, or the statistic where it has none."""
    names = list(dict.fromkeys(test.name for verdict in exact.verdicts.values() for test in verdict.tests))
    columns = (*words("Test"), *(Column(subject) for subject in exact.verdicts))
    outcomes = {
        (subject, test.name): test for subject, verdict in exact.verdicts.items() for test in verdict.tests
    }
    rows = []
    for name in names:
        cells: list[Cell] = [label_of_test(name)]
        for subject in exact.verdicts:
            test = outcomes.get((subject, name))
            if test is None:
                cells.append(MISSING)
                continue
            value = test.statistic if test.p_value is None else test.p_value
            text = significant(value, 2)
            cells.append(Strong(text) if test.flagged else text)
        rows.append(Row(tuple(cells)))
    note = (
        "p-values against recordings that the model itself made of the same subject; where a test has no "
        "null distribution, its statistic. Bold: flagged."
    )
    return Table(f"Could the model have made the recording? ({cohort_title})", columns, tuple(rows), note)


def exact_table(exact: Exact, cohort_title: str) -> Table:
    """Return the exact posterior of every subject beside the network's and the CMA-ES fit."""
    mass = exact.experiment.credible_percent / 100.0
    columns = (
        *words("Subject", "Parameter", "Unit"),
        Column("Median"),
        Column("Credible interval", as_percent(mass)),
        Column("Median, network alone"),
        Column("CMA-ES"),
        *words("Draws by", "Verdict"),
    )
    fits = {
        (str(row["subject"]), str(row["parameter"])): float(row["cmaes"])
        for row in records(exact.experiment.posterior)
    }
    rows = []
    for subject, verdict in exact.verdicts.items():
        result = exact.results[subject]
        for j, name in enumerate(PHI_NAMES):
            low, high = np.quantile(result.phi[:, j], interval_levels(mass))
            cells = (
                subject,
                SYMBOLS[name],
                UNITS[name],
                *estimate(float(np.median(result.phi[:, j])), float(low), float(high)),
                significant(float(np.median(result.npe_phi[:, j]))),
                significant(fits.get((subject, name), math.nan)),
                sampler_in_words(verdict),
                verdict.status,
            )
            rows.append(Row(cells, muted=not verdict.may_be_read, strained=verdict.status == STRAINED))
    note = (
        "The posterior of a contradicted subject says where the model's best answer lies and is not to "
        "be read as that of the subject. Passive stiffness: a nuisance parameter, inferred with the others."
    )
    return Table(f"Exact posteriors ({cohort_title}).", columns, tuple(rows), note)


def truth_table(exact: Exact, cohort_title: str) -> Table:
    """Return true parameters of a generated cohort beside their credible intervals."""
    columns = (
        *words("Subject", "Verdict", "Parameter", "Unit"),
        Column("Truth"),
        Column("Median"),
        Column("Credible interval", f"{exact.experiment.credible_percent:g} %"),
        *words("Inside"),
    )
    rows = []
    for row in records(exact.truth):
        known = not pd.isna(row["median"])
        inside = ("yes" if is_true(row["inside"]) else "no") if known else MISSING
        cells = (
            str(row["subject"]),
            str(row["status"]),
            PARAMETERS[str(row["parameter"])],
            PARAMETER_UNITS[str(row["parameter"])],
            significant(row["truth"]),
            *estimate(row["median"], row["low"], row["high"]),
            inside,
        )
        rows.append(Row(cells, muted=not known, strained=known and row["status"] == STRAINED))
    note = (
        "The recordings were generated with a richer physiology than the model's, so its best parameters "
        "need not equal these. The discrepancy of the observation model is meant to cover the difference."
    )
    return Table(f"Truth of the generated recordings ({cohort_title}).", columns, tuple(rows), note)


def identifiability_table(exact: Exact, cohort_title: str) -> Table:
    """Return how far the recording narrows each quantity, and what the likelihood alone says."""
    columns = (
        *words("Subject", "Quantity"),
        Column("Contraction", "log scale"),
        Column("Posterior sd", "% of the value"),
        Column("Expected sd", "% of the value"),
        Column("Likelihood interval"),
    )
    rows = []
    for row in records(exact.identifiability):
        name = str(row["quantity"])
        cells = (
            str(row["subject"]),
            SYMBOLS.get(name) or quantity(name),
            fixed(row["contraction_log"], 3),
            percent(row["sd_log"]),
            percent(row["expected_sd_log"]),
            _likelihood_interval(row),
        )
        rows.append(Row(cells))
    note = (
        "Contraction: 1 − posterior variance / prior variance of the logarithm. Expected: by the information "
        "of the phases. An end of the likelihood interval in brackets is the bound of the prior: the "
        "recording alone does not close it."
    )
    return Table(f"What a recording tells ({cohort_title}).", columns, tuple(rows), note)


def noise_table(exact: Exact, cohort_title: str) -> Table:
    """Return the noise components, and the discrepancy that stands beside them."""
    columns = (
        *words("Component"),
        Column("Size", "% of the speed"),
        Column("Standard error"),
        Column("Interval", as_percent(exact.noise.interval)),
    )
    pooled = exact.noise.pooled
    rows = [
        Row(
            (
                f"between {name}s",
                percent(part.fraction, 2),
                percent(part.standard_error, 2),
                _limits(part.low, part.high),
            )
        )
        for name, part in pooled.parts.items()
    ]
    discrepancy = exact.experiment.settings["observation_model"]["discrepancy"]
    rows.append(
        Row(("model discrepancy in speed", percent(discrepancy["speed_fraction"], 2), MISSING, "set"))
    )
    timing = percent(discrepancy["timing_cycle"], 2)
    rows.append(Row(("model discrepancy in timing, % of the cycle", timing, MISSING, "set")))
    note = (
        f"Noise from {count(pooled.samples)} samples in {count(pooled.repeats)} repeats, by restricted "
        f"maximum likelihood; the same in all recordings: p = {exact.noise.homogeneity_p:.2g}. The "
        "discrepancy was chosen on a generated cohort, none of whose subjects is shown here."
    )
    return Table(f"Noise of the measured speeds ({cohort_title}).", columns, tuple(rows), note)


def _flag(test: VerdictTest) -> str:
    p = "" if test.p_value is None else f" (p = {fixed(test.p_value, 4)})"
    return f"{label_of_test(test.name)}{p}"


def _limits(low: float, high: float) -> str:
    return span(percent(low, 2), percent(high, 2))


def _likelihood_interval(row: Mapping[Hashable, Any]) -> str:
    ends = []
    for name in ("likelihood_low", "likelihood_high"):
        text = significant(row[name])
        ends.append(f"({text})" if is_true(row[f"{name}_open"]) else text)
    return span(*ends)
