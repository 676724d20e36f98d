"""The figures of the study: who draws each, and what the workflow's report prints of it.

Workflow and drawing rules read this list; drawing is in the modules beside, which import matplotlib, and this
one does not. A new figure has its entry here, its drawing, its stage, its rule and its test. One of the
cohort is on the page with that; :mod:`swesbi.report.page.figures` gives it a caption and a place of its own
there, and has the figures of experiments that the page shows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

_PPC: Final = (
    "Predictive check of {subject} in the experiment *{experiment}* ({cohort}): observed stiffness with its "
    "standard error, medians and bands of the prior and the posterior prediction, CMA-ES fit."
)
_COHORT_POSTERIOR: Final = (
    "Every subject alone (grey) and within its population (coloured by verdict) in the experiment "
    "*{experiment}* ({cohort}): medians and credible intervals, over the band in which 90 % of such persons "
    "lie; where the cohort has groups, the median of each parameter by group and the posterior of their "
    "ratio."
)


@dataclass(frozen=True)
class FigureSpec:
    """One figure.

    Attributes:
        rule: The rule that draws it.
        name: Its file's name without suffix; for an experiment, ``-<experiment>`` follows.
        of: What there is one of it for: the cohort, each experiment, each of those on speeds or over a
            population, or each subject of an experiment.
        label: What the report lists it as.
        caption: What the report prints below it: reStructuredText with the fields ``cohort``, ``experiment``
            and ``subject``.
        subcategory: Where the report lists it, in the experiment.
    """

    rule: str
    name: str
    of: Literal["cohort", "experiment", "speeds", "population", "subject"]
    label: str
    caption: str
    subcategory: str = "Whole cohort"


# fmt: off
FIGURES: Final = (
    FigureSpec(
        "workflow_figure", "workflow", "cohort", "figure 1: workflow",
        "Figure 1. The workflow, drawn from this run ({cohort}): prior samples and context give "
        "simulated curves, whose features train the network; the observed features of one subject give "
        "its posterior.",
    ),
    FigureSpec(
        "cohort_figures", "ppc", "cohort", "figure 2: predictive checks",
        "Figure 2. Predictive checks of each subject ({cohort}): observed stiffness with its standard "
        "error, medians and bands of noiseless curves of the prior and the posterior, the posterior's wider "
        "interval of new observations (light), CMA-ES fit. Subjects outside the prior's support are grey.",
    ),
    FigureSpec(
        "cohort_figures", "posterior", "cohort", "figure 3: posteriors",
        "Figure 3. Posterior of the three parameters of each subject ({cohort}), with medians and "
        "credible intervals, the prior, and the CMA-ES fit. Subjects outside the prior's support are "
        "grey.",
    ),
    FigureSpec(
        "training_figure", "training", "experiment", "training",
        "Training and validation loss of the experiment *{experiment}*, epoch by epoch ({trained_on}).",
    ),
    FigureSpec(
        "exact_figures", "ppc", "speeds", "predictive checks",
        "Predictive checks of each subject in the experiment *{experiment}* ({cohort}): medians of the "
        "noiseless prediction within intervals of new recordings, measurement noise and model "
        "discrepancy included. Contradicted subjects are grey, with the tests that say so.",
    ),
    FigureSpec(
        "exact_figures", "posterior", "speeds", "exact posteriors",
        "Exact posteriors of each subject in the experiment *{experiment}* ({cohort}), coloured by "
        "verdict, the network's own draws as outlines; below, Pareto shape and efficiency of the "
        "importance weights. Stars: truth of a generated cohort.",
    ),
    FigureSpec(
        "calibration_figure", "calibration", "speeds", "calibration",
        "Calibration on recordings of known parameters, each with its own exact posterior. Ranks of the "
        "truth are uniform where posteriors are right; grey: bands that hold at all points at once with "
        "95 % probability, for all quantities together. Contraction (in the table) stands beside them, "
        "since the prior returned as posterior has uniform ranks too. Local calibration: draws of a "
        "subject's posterior, ranked in the posterior given a second recording simulated from them; and "
        "a classifier between the samplers and long Markov chains (0.5: no difference).",
    ),
    FigureSpec(
        "misspecification_figure", "misspecification", "speeds", "misspecification tests",
        "Misspecification tests. Each p-value is judged among well-specified recordings of other hearts, "
        "each with its own exact posterior; both tests together raise a false alarm in 3 % of them. Bars: "
        "alarms on the recordings of known parameters behind the checks of calibration. Predicted volumes, "
        "ejection and context, which do not change with the recording's noise, are left out of the bars.",
    ),
    FigureSpec(
        "identifiability_figures", "identifiability", "speeds", "what the recordings tell",
        "What the recordings tell in the experiment *{experiment}*. Above: the exact likelihood profiled "
        r"along :math:`k_0` and :math:`k_\mathrm{{ATP}}`, with likelihood-ratio confidence regions inside "
        "the prior's box, posterior draws, and the line of equal isometric stiffness. Below: by how much "
        "the posterior sd of each quantity grows without a phase, expected and found.",
    ),
    FigureSpec(
        "cohort_posterior_figure", "cohort_posterior", "speeds", "the cohort as a posterior",
        _COHORT_POSTERIOR,
    ),
    FigureSpec(
        "population_cohort", "cohort", "population", "overview of the cohort",
        "The whole cohort ({cohort}) as the experiment *{experiment}* answers it, a row a parameter: "
        "medians and 90 % intervals in ascending order, coloured by verdict, against heart rate, age and "
        "end-diastolic volume, and against the truth of a generated cohort. Below: verdicts, what speaks "
        "against the model, and the efficiency of the importance weights.",
    ),
    FigureSpec(
        "cohort_posterior_figure", "cohort_posterior", "population", "the cohort as a posterior",
        _COHORT_POSTERIOR,
    ),
    FigureSpec(
        "strata_figure", "strata", "population", "coverage by stratum, drawn",
        "Coverage of 90 % intervals on fresh contexts by sex, age, heart rate and noise level, of the "
        "network alone and of the exact posterior, with 95 % Clopper-Pearson intervals; at the right the "
        "median efficiency of the importance weights.",
        "Calibration",
    ),
    FigureSpec(
        "pressures_figure", "pressures", "population", "what cuff pressures add",
        "Medians and credible intervals of each subject with cuff pressures ({cohort}) as the experiment "
        "*{experiment}* answers: from the speeds alone, and from speeds and pressures together, with which "
        "the stressed volume of the circulation is free too.",
    ),
    FigureSpec("subject_figures", "ppc", "subject", "predictive check", _PPC),
    FigureSpec(
        "subject_figures", "posterior", "subject", "posterior",
        "Posterior of {subject} in the experiment *{experiment}* ({cohort}): marginals with medians and "
        "credible intervals, pairs with correlations, CMA-ES fit.",
    ),
    FigureSpec("exact_subject_figures", "ppc", "subject", "predictive check", _PPC),
    FigureSpec(
        "exact_subject_figures", "posterior", "subject", "exact posterior",
        "Exact posterior of {subject} in the experiment *{experiment}* ({cohort}): marginals and pairs "
        "of the active parameters and the passive stiffness, the network's own draws as outlines, CMA-ES "
        "fit, and the truth where the recording was generated.",
    ),
)
"""In the order in which the study lists them."""
# fmt: on


def names_of(of: str) -> list[str]:
    """Return the names of the figures of the cohort, or of each experiment of a kind."""
    return [figure.name for figure in FIGURES if figure.of == of]


def figure_of(rule: str, name: str) -> FigureSpec:
    """Return the figure of this name that a rule draws.

    Raises:
        KeyError: It draws none.
    """
    by_key = {(figure.rule, figure.name): figure for figure in FIGURES}
    return by_key[rule, name]


def captions() -> dict[str, list[str]]:
    """Return the captions of every rule's figures, for the template that all of them share."""
    texts: dict[str, list[str]] = {}
    for figure in FIGURES:
        texts.setdefault(figure.rule, []).append(figure.caption)
    return texts
