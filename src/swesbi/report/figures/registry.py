"""The one list of figures: who draws each, for what there is one, and what report and page say of it.

Rules, the workflow's report, the page and its tests read this list, which imports no matplotlib. A new figure
has its entry here, its drawing, and its rule, whose stage is the draw function. Where a template of the page
has no place for a figure of the cohort, it stands on the page beside the experiments.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

Scope = Literal["cohort", "recordings", "experiment", "speeds", "population", "subject"]
"""What there is one figure for: the cohort, all recordings, each experiment, each of those on speeds or over
a population, or each subject of an experiment."""
WHOLE: Final = ("cohort", "recordings")
ON_PAGE: Final[dict[Scope, tuple[Scope, ...]]] = {
    "cohort": ("cohort",),
    "experiment": ("experiment",),
    "speeds": ("recordings", "speeds"),
    "population": ("population", "experiment"),
}
"""Figures of which scopes a part of the page shows."""


@dataclass(frozen=True)
class FigureSpec:
    """One figure: its rule, its file's name without suffix, for what there is one, and what is said of it.

    ``label`` and ``subcategory`` are the report's. ``caption`` is printed below it, ``description`` is for
    who cannot see it; both have the fields ``cohort``, ``experiment`` and ``subject``.
    """

    rule: str
    name: str
    of: Scope
    label: str
    caption: str
    description: str
    subcategory: str = "Whole cohort"

    def stem(self, experiment: str) -> str:
        """Return the name of its file without the suffix; for an experiment, ``-<experiment>`` follows."""
        return self.name if self.of in WHOLE else f"{self.name}-{experiment}"

    def texts(self, cohort: str, experiment: str = "", subject: str = "") -> tuple[str, str]:
        """Return its description and its caption."""
        fields = {"cohort": cohort, "experiment": experiment, "subject": subject}
        return self.description.format(**fields), self.caption.format(**fields)


_PPC: Final = (
    "Predictive check of {subject} in the experiment {experiment} ({cohort}): what prior and posterior "
    "predict of the recording, and the measured stiffness with its standard error. Below, prediction minus "
    "recording.",
    "Stiffness over the cardiac cycle of {subject}: measured points within the band of the posterior",
)
_SUBJECT: Final = (
    "Posterior of {subject} in the experiment {experiment} ({cohort}): each parameter with its median and "
    "credible interval over the prior, and each pair with its correlation.",
    "Densities of each parameter of {subject} on a diagonal, scatter plots of each pair below it",
)
_COHORT_POSTERIOR: Final = (
    "Every subject alone (grey) and within its population (coloured by group; open: a recording that is "
    "doubted or contradicted) in the experiment {experiment} ({cohort}): medians and credible intervals, "
    "over the band in which most persons of the group lie. The median of each parameter, by group where the "
    "cohort has several, and the ratio of each group to the reference group follow.",
    "Intervals of each parameter by subject of the {cohort}, alone and within the population",
)

# fmt: off
FIGURES: Final = (
    FigureSpec(
        "workflow_figure", "workflow", "cohort", "figure 1: workflow",
        "Figure 1. The workflow, drawn from this run ({cohort}): the prior (a) gives simulated curves (b), "
        "whose features (c) train the network (d). The features of one recording give its posterior (e), "
        "whose predictions are compared with the recording (f).",
        "Six panels of the workflow, from the prior to the predictive check, with data of the {cohort}",
    ),
    FigureSpec(
        "cohort_figures", "ppc", "cohort", "figure 2: predictive checks",
        "Figure 2. Predictive checks of each subject ({cohort}): measured stiffness, what prior and "
        "posterior predict without noise, and where new recordings would lie (pale). Subjects "
        "outside the prior's support are grey.",
        "Stiffness over the cardiac cycle, a panel a subject of the {cohort}: measured points, bands of "
        "prior and posterior, and the CMA-ES fit",
    ),
    FigureSpec(
        "cohort_figures", "posterior", "cohort", "figure 3: posteriors",
        "Figure 3. Posteriors of the three active parameters of each subject ({cohort}), medians with 50 % "
        "and wider credible intervals, above over the prior, below in percent of the median. Subjects "
        "outside the prior's support are grey.",
        "Intervals of the three parameters, a row a subject of the {cohort}, over the prior",
    ),
    FigureSpec(
        "noise_figure", "noise", "recordings", "noise of the recordings",
        "Noise of the measured speeds ({cohort}): each recording alone, over what the recordings of its "
        "group have together.",
        "Intervals of the relative standard deviation of speeds by subject of the {cohort}, a panel a "
        "source",
    ),
    FigureSpec(
        "exact_figures", "ppc", "speeds", "predictive checks",
        "Predictive checks of each subject in the experiment {experiment} ({cohort}): measured stiffness, "
        "and where prior and posterior expect new recordings. Contradicted subjects are grey, with the "
        "tests that say so.",
        "Stiffness over the cardiac cycle, a panel a subject of the {cohort}: measured points within bands",
    ),
    FigureSpec(
        "exact_figures", "posterior", "speeds", "exact posteriors",
        "Exact posteriors of each subject in the experiment {experiment} ({cohort}), coloured by verdict: "
        "medians with 50 % and wider credible intervals, below what the network alone says, over the prior, "
        "with the truth where it is known. At the right: the effective share of the weighted draws.",
        "Intervals of four parameters, a row a subject of the {cohort}, over the prior",
    ),
    FigureSpec(
        "cohort_posterior_figure", "cohort_posterior", "speeds", "the cohort as a posterior",
        *_COHORT_POSTERIOR,
    ),
    FigureSpec(
        "calibration_figure", "calibration", "speeds", "calibration",
        "Calibration of the experiment {experiment} on recordings of known parameters ({cohort}), each with "
        "its own exact posterior. (a) Ranks of the truth are uniform where posteriors are right; grey: a "
        "band for all points and quantities at once. (b) Coverage of intervals and joint regions. "
        "Contraction (in the table) stands beside them, since the prior returned as posterior has uniform "
        "ranks too.",
        "Ranks within a band around zero, and shares of recordings whose truth lies in the interval, in the "
        "contexts of the {cohort}",
    ),
    FigureSpec(
        "misspecification_figure", "misspecification", "speeds", "misspecification tests",
        "Misspecification tests of the experiment {experiment} ({cohort}). Each p-value is judged among "
        "well-specified recordings of other hearts, each with its own exact posterior. (a) P-values of each "
        "subject; filled: flagged. (b) Alarms on the recordings of known parameters behind the checks of "
        "calibration, of the two tests with a null distribution, and of both together. Volumes, ejection "
        "and context have no part in (b).",
        "Points for the p-value of each test by subject of the {cohort}, and shares of alarms with intervals",
    ),
    FigureSpec(
        "identifiability_figures", "identifiability", "speeds", "what the recordings tell",
        "What the recordings tell in the experiment {experiment} ({cohort}), a point or line for each "
        "subject. Above: contraction against the prior, and sensitivity to prior and likelihood by power "
        "scaling. Middle: posterior draws of k_0 and k_ATP, with the line of equal isometric stiffness. "
        "Below: by how much the expected sd of each quantity grows without a phase.",
        "Contraction and sensitivity of each quantity, pairs of two parameters, and losses by phase, of the "
        "{cohort}",
    ),
    FigureSpec(
        "population_cohort", "cohort", "population", "overview of the cohort",
        "The whole cohort ({cohort}) as the experiment {experiment} answers it, a row a parameter: medians "
        "and intervals in ascending order, coloured by verdict, against heart rate, age and end-diastolic "
        "volume, and against the truth where it is known.",
        "Medians with intervals of four parameters, sorted and against heart rate, age and volume, {cohort}",
    ),
    FigureSpec(
        "cohort_posterior_figure", "cohort_posterior", "population", "the cohort as a posterior",
        *_COHORT_POSTERIOR,
    ),
    FigureSpec(
        "strata_figure", "strata", "population", "coverage by stratum, drawn",
        "Coverage of credible intervals in the population of {experiment}, on fresh contexts by sex, age, "
        "heart rate, volume, septum and noise, of the exact posterior and of the network alone, with "
        "Clopper-Pearson intervals. Grey: within two and within five points, asked of all recordings and of "
        "each stratum.",
        "Coverage by stratum of the population of {experiment}, with intervals around the nominal level",
        "Calibration",
    ),
    FigureSpec(
        "pressures_figure", "pressures", "population", "what cuff pressures add",
        "Medians and credible intervals of each subject with cuff pressures ({cohort}) as the experiment "
        "{experiment} answers: from the speeds alone, and from speeds and pressures together. With "
        "pressures the stressed volume of the circulation is free too.",
        "Intervals of eight quantities by subject of the {cohort}, without and with cuff pressures",
    ),
    FigureSpec(
        "training_figure", "training", "experiment", "training",
        "Training and validation loss of the network of the experiment {experiment}, epoch by epoch.",
        "Training and validation loss against epoch, experiment {experiment}, {cohort}",
    ),
    FigureSpec("subject_figures", "ppc", "subject", "predictive check", *_PPC),
    FigureSpec("subject_figures", "posterior", "subject", "posterior", *_SUBJECT),
    FigureSpec("exact_subject_figures", "ppc", "subject", "predictive check", *_PPC),
    FigureSpec("exact_subject_figures", "posterior", "subject", "exact posterior", *_SUBJECT),
)
"""In the order in which the study lists them."""
# fmt: on


def names_of(scope: Scope) -> list[str]:
    """Return the names of the figures of a scope."""
    return [figure.name for figure in FIGURES if figure.of == scope]


def figure_of(rule: str, name: str) -> FigureSpec:
    """Return the figure of this name that a rule draws."""
    return {(figure.rule, figure.name): figure for figure in FIGURES}[rule, name]


def on_page(scope: Scope) -> dict[str, FigureSpec]:
    """Return the figures that the page shows of the cohort, or of each experiment of a kind, by name."""
    return {figure.name: figure for of in ON_PAGE[scope] for figure in FIGURES if figure.of == of}


def captions() -> dict[str, list[str]]:
    """Return the captions of every rule's figures, for the template that all of them share."""
    return {
        rule: [figure.caption for figure in FIGURES if figure.rule == rule]
        for rule in dict.fromkeys(figure.rule for figure in FIGURES)
    }
