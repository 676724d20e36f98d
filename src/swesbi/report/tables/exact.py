"""An experiment on speeds: verdicts and their tests, exact posteriors, truth, identifiability, noise."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from swesbi.draws import median_and_interval
from swesbi.parameters import PHI_NAMES
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.noise.cohort import CohortNoise, GroupNoise
from swesbi.report.numbers import (
    MISSING,
    PARAMETER_UNITS,
    PARAMETERS,
    as_percent,
    count,
    fixed,
    interval,
    middle,
    quantity,
    significant,
    span,
    yes_or_no,
)
from swesbi.report.results import Experiment, is_true
from swesbi.report.table import Cell, Column, Strong, Table, words
from swesbi.report.tables.subjects import PARAMETER, SUBJECT, UNIT
from swesbi.verdict.summary import label_of_test, sampler_in_words
from swesbi.verdict.verdict import Verdict, VerdictTest

PASSIVE: Final = "passive_stiffness_kpa"
SYMBOLS: Final = {**PARAMETERS, PASSIVE: "passive stiffness a"}
UNITS: Final = {**PARAMETER_UNITS, PASSIVE: "kPa"}
ANSWER: Final = ("median", "low", "high")
VERDICT: Final = words("status", "Verdict")
SAMPLER: Final = words("sampler", "Draws by")


@dataclass(frozen=True)
class Exact:
    """What only an experiment on speeds has.

    Attributes:
        experiment: What every experiment has.
        results: Exact posterior of each subject.
        calibration: ``calibration.csv``.
        alarms: ``alarms.csv``.
        identifiability: ``identifiability.csv``.
        noise: The cohort's noise.
        truth: Its rows of ``truth.csv``; empty for a cohort without known truth.
    """

    experiment: Experiment
    results: Mapping[str, ExactPosterior]
    calibration: pd.DataFrame
    alarms: pd.DataFrame
    identifiability: pd.DataFrame
    noise: CohortNoise
    truth: pd.DataFrame

    @property
    def verdicts(self) -> Mapping[str, Verdict]:
        """Verdict of each subject."""
        return self.experiment.verdicts


def shape(k_hat: float) -> str:
    """Return the Pareto shape of weights, which may be infinite."""
    return "inf" if math.isinf(k_hat) else fixed(k_hat, 2)


def verdicts_table(exact: Exact, cohort_title: str) -> Table:
    """Return the verdict of each subject, the tests behind it, and whether its sampler converged."""
    columns = (
        SUBJECT,
        VERDICT,
        words("against", "Tests that speak against it"),
        SAMPLER,
        Column("k_hat", "k-hat", "", shape),
        Column("efficiency", "Efficiency", "%", "0%"),
        Column("r_hat", "R-hat", "", "3f"),
        words("converged", "Sampler converged", yes_or_no),
    )
    rows = [
        {
            "subject": subject,
            "status": verdict.status,
            "against": ", ".join(_flag(test) for test in verdict.tests if test.flagged) or MISSING,
            "sampler": sampler_in_words(verdict),
            "k_hat": result.k_hat,
            "efficiency": result.efficiency,
            "r_hat": result.largest_r_hat,
            "converged": result.converged,
        }
        for subject, verdict in exact.verdicts.items()
        for result in [exact.results[subject]]
    ]
    note = (
        "Draws come from the network, weighted with the exact likelihood; k-hat is the Pareto shape of the "
        "weights, efficiency their effective share. Where either fails, MCMC on the same likelihood answers, "
        "and R-hat compares its independent ensembles. A sampler that converged says nothing of the verdict: "
        "it has drawn from the posterior, whether or not the model can produce the recording."
    )
    caption = f"Verdict of each subject, and how its draws were made ({cohort_title})."
    return Table(caption, exact.experiment.marked(pd.DataFrame(rows)), columns, note)


def outcomes_table(exact: Exact, cohort_title: str) -> Table:
    """Return every test of every subject: its p-value, or the statistic where it has none."""
    frame = pd.DataFrame(
        {
            subject: {label_of_test(test.name): _outcome(test) for test in verdict.tests}
            for subject, verdict in exact.verdicts.items()
        }
    )
    note = (
        "p-values against recordings that the model itself made of the same subject; where a test has no "
        "null distribution, its statistic. Bold: flagged."
    )
    return Table(
        f"Can the model produce the recording? ({cohort_title})",
        frame.rename_axis("test").reset_index(),
        (words("test", "Test"), *(Column(subject, subject) for subject in exact.verdicts)),
        note,
    )


def _outcome(test: VerdictTest) -> Cell:
    text = significant(test.statistic if test.p_value is None else test.p_value, 2)
    return Strong(text) if test.flagged else text


def exact_table(exact: Exact, cohort_title: str) -> Table:
    """Return the exact posterior of every subject beside the network's and the CMA-ES fit."""
    mass = exact.experiment.credible_percent / 100.0
    columns = (
        SUBJECT,
        words("parameter", "Parameter", SYMBOLS),
        words("parameter", "Unit", UNITS),
        Column(ANSWER, "Median", "", middle),
        Column(ANSWER, "Credible interval", as_percent(mass), interval),
        Column("network", "Median, network alone", "", "3g"),
        Column("cmaes", "CMA-ES", "", "3g"),
        SAMPLER,
        VERDICT,
    )
    answers = pd.DataFrame(list(_answers(exact, mass)))
    fits = exact.experiment.posterior[["subject", "parameter", "cmaes"]]
    frame = answers.merge(fits, how="left", on=["subject", "parameter"])
    note = (
        "The posterior of a contradicted subject says where the model's best answer lies and is not to "
        "be read as that of the subject. Passive stiffness: a nuisance parameter, inferred with the others."
    )
    return Table(f"Exact posteriors ({cohort_title}).", exact.experiment.marked(frame), columns, note)


def _answers(exact: Exact, mass: float) -> Iterator[dict[str, object]]:
    for subject, verdict in exact.verdicts.items():
        result = exact.results[subject]
        low, median, high = median_and_interval(result.phi, mass)
        network = np.median(result.proposal_phi, axis=0)
        how = {"subject": subject, "sampler": sampler_in_words(verdict), "status": verdict.status}
        for j, name in enumerate(PHI_NAMES):
            answer = {"median": median[j], "low": low[j], "high": high[j], "network": network[j]}
            yield {**how, "parameter": name, **answer}


def truth_table(exact: Exact, cohort_title: str) -> Table:
    """Return true parameters of a generated cohort beside their credible intervals."""
    columns = (
        SUBJECT,
        VERDICT,
        PARAMETER,
        UNIT,
        Column("truth", "Truth", "", "3g"),
        Column(ANSWER, "Median", "", middle),
        Column(ANSWER, "Credible interval", f"{exact.experiment.credible_percent:g} %", interval),
        words("inside", "Inside", yes_or_no),
    )
    note = (
        "The recordings were generated with a richer physiology than the model's, so its best parameters "
        "need not equal these. The discrepancy of the observation model is meant to cover the difference."
    )
    caption = f"Truth of the generated recordings ({cohort_title})."
    return Table(caption, exact.experiment.marked(exact.truth), columns, note)


def identifiability_table(exact: Exact, cohort_title: str) -> Table:
    """Return how far the recording narrows each quantity, and what the likelihood alone says."""
    ends = ("likelihood_low", "likelihood_low_open", "likelihood_high", "likelihood_high_open")
    columns = (
        SUBJECT,
        words("quantity", "Quantity", lambda name: SYMBOLS.get(name) or quantity(name)),
        Column("contraction_log", "Contraction", "log scale", "3f"),
        Column("sd_log", "Posterior sd", "% of the value", "1%"),
        Column("expected_sd_log", "Expected sd", "% of the value", "1%"),
        Column(ends, "Likelihood interval", "", _likelihood_interval),
    )
    note = (
        "Contraction: 1 − posterior variance / prior variance of the logarithm. Expected: by the information "
        "of the phases. An end of the likelihood interval in brackets is the bound of the prior: the "
        "recording alone does not close it."
    )
    return Table(f"What a recording tells ({cohort_title}).", exact.identifiability, columns, note)


def _likelihood_interval(low: float, low_open: object, high: float, high_open: object) -> str:
    ends = ((significant(low), low_open), (significant(high), high_open))
    return span(*(f"({text})" if is_true(opened) else text for text, opened in ends))


def noise_table(exact: Exact, cohort_title: str) -> Table:
    """Return the noise components, and the discrepancy that stands beside them."""
    columns = (
        words("component", "Component"),
        Column("fraction", "Size", "% of the speed", "2%"),
        Column("standard_error", "Standard error", "", "2%"),
        Column(("low", "high"), "Interval", as_percent(exact.noise.interval), "2%"),
    )
    groups = exact.noise.groups
    discrepancy = exact.experiment.settings["observation_model"]["discrepancy"]
    rows = [
        *(
            {"component": f"between {name}s{_of_group(group, groups)}", **vars(part)}
            for group, noise in groups.items()
            for name, part in noise.pooled.parts.items()
        ),
        {"component": "model discrepancy in speed", "fraction": discrepancy["speed_fraction"]},
        {
            "component": "model discrepancy in timing, % of the cycle",
            "fraction": discrepancy["timing_cycle"],
        },
    ]
    of_group = " ".join(
        f"From {count(noise.pooled.samples)} samples in {count(noise.pooled.repeats)} repeats"
        f"{_of_group(group, groups)}; the same in all these recordings: p = {noise.homogeneity_p:.2g}."
        for group, noise in groups.items()
    )
    note = (
        f"Noise by restricted maximum likelihood. {of_group} The discrepancy was chosen on a generated "
        "cohort, none of whose subjects is shown here."
    )
    return Table(f"Noise of the measured speeds ({cohort_title}).", pd.DataFrame(rows), columns, note)


def _of_group(name: str, groups: Mapping[str, GroupNoise]) -> str:
    """Return which recordings are meant, where a cohort has several groups."""
    return "" if len(groups) == 1 else f", {name} ({', '.join(groups[name].by_subject)})"


def _flag(test: VerdictTest) -> str:
    p = "" if test.p_value is None else f" (p = {fixed(test.p_value, 4)})"
    return f"{label_of_test(test.name)}{p}"
