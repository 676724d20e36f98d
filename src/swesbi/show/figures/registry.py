"""The figures of the study: who draws each, and what the workflow's report and the page say of it.

Page, documentation and workflow read these lists; drawing is in the modules beside, which import matplotlib,
and this one does not. A new figure has its entries here, its drawing, its rule and its test.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Literal

Texts = tuple[str, str]
_PPC: Final = (
    "Predictive check of {subject} in the experiment *{experiment}* ({cohort}): observed stiffness with its "
    "standard error, medians and bands of the prior and the posterior prediction, CMA-ES fit."
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
        caption: What the report says below it: reStructuredText with the fields ``cohort``, ``experiment``
            and ``subject``.
        subcategory: Where the report lists it, in the experiment.
    """

    rule: str
    name: str
    of: Literal["cohort", "experiment", "speeds", "population", "subject"]
    label: str
    caption: str
    subcategory: str = "Whole cohort"


FIGURES: Final = (
    FigureSpec(
        "workflow_figure",
        "workflow",
        "cohort",
        "figure 1: workflow",
        "Figure 1. The workflow, drawn from this run ({cohort}): prior samples and context give "
        "simulated curves, whose features train the network; the observed features of one subject give "
        "its posterior.",
    ),
    FigureSpec(
        "cohort_figures",
        "ppc",
        "cohort",
        "figure 2: predictive checks",
        "Figure 2. Predictive checks of each subject ({cohort}): observed stiffness with its standard "
        "error, medians and bands of the prior and the posterior prediction, CMA-ES fit. Subjects "
        "outside the prior's support are grey.",
    ),
    FigureSpec(
        "cohort_figures",
        "posterior",
        "cohort",
        "figure 3: posteriors",
        "Figure 3. Posterior of the three parameters of each subject ({cohort}), with medians and "
        "credible intervals, the prior, and the CMA-ES fit. Subjects outside the prior's support are "
        "grey.",
    ),
    FigureSpec(
        "experiments_figure",
        "experiments",
        "cohort",
        "experiments beside each other",
        "Predictive error, coverage and contraction rate of every experiment beside each other "
        "({cohort}). Bands of experiments on measured speeds are of new recordings, noise included.",
    ),
    FigureSpec(
        "epochs_figure",
        "epochs",
        "cohort",
        "recovery and coverage by epoch",
        "How recovery, the predictive band's coverage of the recordings and the posterior's width evolve "
        "with the epochs of one training ({cohort}).",
    ),
    FigureSpec(
        "training_figure",
        "training",
        "experiment",
        "training",
        "Training and validation loss of the experiment *{experiment}*, epoch by epoch ({trained_on}).",
    ),
    FigureSpec(
        "exact_figures",
        "ppc",
        "speeds",
        "predictive checks",
        "Predictive checks of each subject in the experiment *{experiment}* ({cohort}): medians of the "
        "noiseless prediction within intervals of new recordings, measurement noise and model "
        "discrepancy included. Unsupported subjects are grey, with the tests that say so.",
    ),
    FigureSpec(
        "exact_figures",
        "posterior",
        "speeds",
        "exact posteriors",
        "Exact posteriors of each subject in the experiment *{experiment}* ({cohort}), coloured by "
        "verdict, the network's own draws as outlines; below, Pareto shape and efficiency of the "
        "importance weights. Stars: truth of a generated cohort.",
    ),
    FigureSpec(
        "calibration_figure",
        "calibration",
        "speeds",
        "calibration",
        "Calibration on recordings of known parameters, each with its own exact posterior. Ranks of the "
        "truth are uniform where posteriors are right; grey: bands that hold at all points at once with "
        "95 % probability, for all quantities together. Contraction (in the table) stands beside them, "
        "since the prior returned as posterior has uniform ranks too. Local calibration: draws of a "
        "subject's posterior, ranked in the posterior given a second recording simulated from them; and "
        "a classifier between the samplers and long Markov chains (0.5: no difference).",
    ),
    FigureSpec(
        "misspecification_figure",
        "misspecification",
        "speeds",
        "misspecification tests",
        "Misspecification tests. Each p-value is judged against well-specified recordings of the same "
        "subject, each with its own exact posterior; all tests together raise a false alarm in 5 % of "
        "them. Bars: alarms on further well-specified recordings (under the model's own noise, and "
        "acquired sample by sample) and on the virtual volunteers recorded anew, whose physiology is "
        "richer than the model's. Alarms are those of the tests with a null distribution; predicted "
        "volumes and the context, which do not change with the recording's noise, are left out of the "
        "bars.",
    ),
    FigureSpec(
        "identifiability_figures",
        "identifiability",
        "speeds",
        "what the recordings tell",
        "What the recordings tell in the experiment *{experiment}*. Above: the exact likelihood profiled "
        r"along :math:`k_0` and :math:`k_\mathrm{{ATP}}`, with likelihood-ratio confidence regions inside "
        "the prior's box, posterior draws, and the line of equal attained stiffness. Below: by how much "
        "the posterior sd of each quantity grows without a phase, expected and found.",
    ),
    FigureSpec(
        "identifiability_figures",
        "design",
        "speeds",
        "more repeats or phases",
        "What more repeats or more phases would buy in the experiment *{experiment}*: expected "
        "half-width of the credible intervals, by prior precision and expected information. No number of "
        "repeats gets below the dashed line, the model's own errors.",
    ),
    FigureSpec(
        "population_cohort",
        "cohort",
        "population",
        "overview of the cohort",
        "The whole cohort ({cohort}) as the experiment *{experiment}* answers it, a row a parameter: "
        "medians and 90 % intervals in ascending order, coloured by verdict, against heart rate, age and "
        "end-diastolic volume, and against the truth of a generated cohort. Below: verdicts, what speaks "
        "against the model, and the efficiency of the importance weights.",
    ),
    FigureSpec(
        "strata_figure",
        "strata",
        "population",
        "coverage by stratum, drawn",
        "Coverage of 90 % intervals on fresh contexts by sex, age, heart rate and noise level, of the "
        "network alone and of the exact posterior, with 95 % Clopper-Pearson intervals; at the right the "
        "median efficiency of the importance weights.",
        "Calibration",
    ),
    FigureSpec("subject_figures", "ppc", "subject", "predictive check", _PPC),
    FigureSpec(
        "subject_figures",
        "posterior",
        "subject",
        "posterior",
        "Posterior of {subject} in the experiment *{experiment}* ({cohort}): marginals with medians and "
        "credible intervals, pairs with correlations, CMA-ES fit.",
    ),
    FigureSpec("exact_subject_figures", "ppc", "subject", "predictive check", _PPC),
    FigureSpec(
        "exact_subject_figures",
        "posterior",
        "subject",
        "exact posterior",
        "Exact posterior of {subject} in the experiment *{experiment}* ({cohort}): marginals and pairs "
        "of the active parameters and the passive scale, the network's own draws as outlines, CMA-ES "
        "fit, and the truth where the recording was generated.",
    ),
)
"""In the order in which the study lists them."""


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


class PagePart(StrEnum):
    """The part of the page where a figure stands, of which the study has one or one an experiment."""

    STUDY = "study"
    EXPERIMENT = "experiment"
    SPEEDS = "experiment on speeds"
    POPULATION = "experiment over a population"


@dataclass(frozen=True)
class PageFigure:
    """What the page says of a figure.

    Attributes:
        name: Its kind: the file's stem up to the experiment's name.
        part: Where it stands on the page.
        caption: Its caption, with the fields ``title`` (what the subjects are), ``experiment``, and for
            figures of the study ``predictive`` and ``credible`` (masses in percent) and ``excluded``.
        description: The same for who cannot see it; the caption with the experiment's name where empty.
        shared: One file serves every experiment.
        documented: The documentation shows it too.
    """

    name: str
    part: PagePart
    caption: str
    description: str = "{caption}; experiment {experiment}, {title}"
    shared: bool = False
    documented: bool = True

    def stem(self, experiment: str) -> str:
        """Return the name of its file without the suffix."""
        whole = self.shared or self.part is PagePart.STUDY
        return self.name if whole else f"{self.name}-{experiment}"

    def texts(self, title: str, experiment: str = "", fields: Mapping[str, object] | None = None) -> Texts:
        """Return its description and its caption.

        Args:
            title: What the subjects are ("virtual volunteers").
            experiment: Name of the experiment.
            fields: What else its texts name.

        Raises:
            KeyError: Its texts name a field that is not given.
        """
        known = {"title": title, "experiment": experiment, **(fields or {})}
        caption = self.caption.format(**known).strip()
        bare = caption.removesuffix(".").removesuffix(f" ({title})")
        return self.description.format(caption=bare, **known), caption


PAGE_FIGURES: Final = (
    PageFigure(
        "workflow",
        PagePart.STUDY,
        "Figure 1. The workflow, drawn from this run: prior samples and context give simulated curves, whose "
        "features train the network; the observed features of one subject give its posterior ({title}).",
        "Diagram of the workflow, from prior and recording to posterior, with data of {title}",
    ),
    PageFigure(
        "ppc",
        PagePart.STUDY,
        "Figure 2. Predictive checks of each subject ({title}): observed stiffness with its standard error, "
        "medians and {predictive:g} % bands of the prior and the posterior prediction, CMA-ES fit. "
        "{excluded}",
        "Stiffness over the cardiac cycle, one panel a subject of the {title}: observed with standard "
        "errors, prior and posterior predictive medians and bands, and the CMA-ES fit",
    ),
    PageFigure(
        "posterior",
        PagePart.STUDY,
        "Figure 3. Posterior of the three parameters of each subject ({title}), with medians and "
        "{credible:g} % credible intervals, beside the CMA-ES fit. {excluded}",
        "Marginal posterior distributions of the three parameters of the {title}, with medians, credible "
        "intervals, the prior and the CMA-ES estimates",
    ),
    PageFigure(
        "experiments",
        PagePart.STUDY,
        "Predictive error, coverage and contraction rate of every experiment, beside each other ({title}).",
        "RMSE, coverage and contraction rate of every experiment, subject by subject, {title}",
    ),
    PageFigure(
        "epochs",
        PagePart.STUDY,
        "Inference by epoch of training, experiment {experiment} ({title}): losses, what credible intervals "
        "cover on synthetic recordings, what predictive bands cover of the recordings, and how wide the "
        "posteriors are.",
        "Four panels against the epoch of training: loss, recovery coverage, coverage of the recordings by "
        "the predictive band, and relative posterior standard deviation; {title}",
    ),
    PageFigure(
        "training",
        PagePart.EXPERIMENT,
        "Training and validation loss of the experiment {experiment} ({title}).",
        "Training and validation loss against epoch, experiment {experiment}, {title}",
        documented=False,
    ),
    PageFigure(
        "noise",
        PagePart.SPEEDS,
        "Noise of the measured speeds: components of the cohort and of each recording alone ({title}).",
        shared=True,
        documented=False,
    ),
    PageFigure(
        "ppc",
        PagePart.SPEEDS,
        "Predictive checks: observed stiffness with its standard error, predictive medians within bands of "
        "new recordings, noise and model discrepancy included ({title}).",
    ),
    PageFigure(
        "posterior",
        PagePart.SPEEDS,
        "Exact posteriors by verdict, the network's own draws as outlines, and the reliability of the "
        "importance weights ({title}).",
    ),
    PageFigure(
        "calibration",
        PagePart.SPEEDS,
        "Calibration: ranks, coverage and joint coverage on recordings of known parameters ({title}).",
    ),
    PageFigure(
        "misspecification",
        PagePart.SPEEDS,
        "Misspecification: p-values of every test, and alarms on recordings of known origin ({title}).",
    ),
    PageFigure(
        "identifiability",
        PagePart.SPEEDS,
        "What a recording tells: exact likelihood along two parameters, and what is lost without a phase "
        "({title}).",
    ),
    PageFigure("design", PagePart.SPEEDS, "What more repeats or more phases would buy ({title})."),
    PageFigure(
        "cohort",
        PagePart.POPULATION,
        "Every answer of the cohort, a row a parameter: medians with intervals in ascending order, by "
        "verdict; against heart rate, age and end-diastolic volume; against the truth where it is known. "
        "Below: verdicts, what speaks against the model, efficiency of the weights ({title}).",
    ),
    PageFigure(
        "strata",
        PagePart.POPULATION,
        "Coverage of credible intervals by stratum, of the network alone and of the exact posterior, and "
        "efficiency of the weights (contexts of the population of {experiment}).",
        "{caption}",
    ),
    PageFigure(
        "training",
        PagePart.POPULATION,
        "Training and validation loss of the network (contexts of the population of {experiment}).",
        "{caption}",
        documented=False,
    ),
)


def figures_of(part: PagePart) -> dict[str, PageFigure]:
    """Return the figures of a part of the page by name, in the order of the list."""
    return {spec.name: spec for spec in PAGE_FIGURES if spec.part is part}
