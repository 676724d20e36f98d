"""What the page and the documentation say of each figure, and where it stands.

A figure of the cohort that has no entry here stands beside the experiments, with the caption of the report.
matplotlib is not imported.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from swesbi.report.figures.registry import FIGURES

Texts = tuple[str, str]


class PagePart(StrEnum):
    """The part of the page where a figure stands, of which the study has one or one an experiment."""

    STUDY = "study"
    EXPERIMENT = "experiment"
    SPEEDS = "experiment on speeds"
    POPULATION = "experiment over a population"


@dataclass(frozen=True)
class PageFigure:
    """What the page prints of a figure.

    Attributes:
        name: Its kind: the file's stem up to the experiment's name.
        part: Where it stands on the page.
        caption: Its caption, with the fields ``title`` or ``cohort`` (what the subjects are), ``experiment``,
            and for figures of the study ``predictive`` and ``credible`` (masses in percent) and ``excluded``.
        description: The same for who cannot see it; the caption with the experiment's name where empty.
        shared: One file serves every experiment.
    """

    name: str
    part: PagePart
    caption: str
    description: str = "{caption}; experiment {experiment}, {title}"
    shared: bool = False

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
        known = {"title": title, "cohort": title, "experiment": experiment, **(fields or {})}
        caption = self.caption.format(**known).strip()
        bare = caption.removesuffix(".").removesuffix(f" ({title})")
        return self.description.format(caption=bare, **known), caption


# fmt: off
PAGE_FIGURES: Final = (
    PageFigure(
        "workflow", PagePart.STUDY,
        "Figure 1. The workflow, drawn from this run: prior samples and context give simulated curves, whose "
        "features train the network; the observed features of one subject give its posterior ({title}).",
        "Diagram of the workflow, from prior and recording to posterior, with data of {title}",
    ),
    PageFigure(
        "ppc", PagePart.STUDY,
        "Figure 2. Predictive checks of each subject ({title}): observed stiffness with its standard error, "
        "medians and {predictive:g} % bands of noiseless curves of the prior and the posterior, the "
        "posterior's wider {predictive:g} % interval of new observations (light), CMA-ES fit. {excluded}",
        "Stiffness over the cardiac cycle, one panel per subject of the {title}: observed with standard "
        "errors, prior and posterior predictive medians and bands of noiseless curves, the posterior's wider "
        "interval of new observations, and the CMA-ES fit",
    ),
    PageFigure(
        "posterior", PagePart.STUDY,
        "Figure 3. Posterior of the three parameters of each subject ({title}), with medians and "
        "{credible:g} % credible intervals, beside the CMA-ES fit. {excluded}",
        "Marginal posterior distributions of the three parameters of the {title}, with medians, credible "
        "intervals, the prior and the CMA-ES estimates",
    ),
    PageFigure(
        "training", PagePart.EXPERIMENT,
        "Training and validation loss of the experiment {experiment} ({title}).",
        "Training and validation loss against epoch, experiment {experiment}, {title}",
    ),
    PageFigure(
        "noise", PagePart.SPEEDS,
        "Noise of the measured speeds: components of the cohort and of each recording alone ({title}).",
        shared=True,
    ),
    PageFigure(
        "ppc", PagePart.SPEEDS,
        "Predictive checks: observed stiffness with its standard error, predictive medians within bands of "
        "new recordings, noise and model discrepancy included ({title}).",
    ),
    PageFigure(
        "posterior", PagePart.SPEEDS,
        "Exact posteriors by verdict, the network's own draws as outlines, and the reliability of the "
        "importance weights ({title}).",
    ),
    PageFigure(
        "cohort_posterior", PagePart.SPEEDS,
        "Every subject alone (grey) and within its population (coloured by verdict), over the band in which "
        "nine of ten such persons lie; below, where there are groups, each parameter by group and their "
        "ratio ({title}).",
    ),
    PageFigure(
        "calibration", PagePart.SPEEDS,
        "Calibration: ranks, coverage and joint coverage on recordings of known parameters ({title}).",
    ),
    PageFigure(
        "misspecification", PagePart.SPEEDS,
        "Misspecification: p-values of every test, and alarms on recordings of known origin ({title}).",
    ),
    PageFigure(
        "identifiability", PagePart.SPEEDS,
        "What a recording determines: exact likelihood along two parameters, and the loss without each phase "
        "({title}).",
    ),
    PageFigure(
        "cohort", PagePart.POPULATION,
        "Every posterior of the cohort, a row per parameter: medians with intervals in ascending order, by "
        "verdict; against heart rate, age and end-diastolic volume; against the truth where it is known. "
        "Below: verdicts, tests that contradict the model, efficiency of the weights ({title}).",
    ),
    PageFigure(
        "cohort_posterior", PagePart.POPULATION,
        "Every subject alone (grey) and within its population (coloured by verdict), over the band in which "
        "nine of ten such persons lie; below, where there are groups, each parameter by group and their "
        "ratio ({title}).",
    ),
    PageFigure(
        "strata", PagePart.POPULATION,
        "Coverage of credible intervals by stratum, of the network alone and of the exact posterior, and "
        "efficiency of the weights (contexts of the population of {experiment}).",
        "{caption}",
    ),
    PageFigure(
        "pressures", PagePart.POPULATION,
        "Without and with cuff pressures: medians and intervals from the speeds alone, and from speeds and "
        "pressures together ({title}).",
    ),
    PageFigure(
        "training", PagePart.POPULATION,
        "Training and validation loss of the network (contexts of the population of {experiment}).",
        "{caption}",
    ),
)
# fmt: on


def figures_of(part: PagePart) -> dict[str, PageFigure]:
    """Return the figures of a part of the page by name, in the order of the list; `further_figures` last."""
    listed = {spec.name: spec for spec in PAGE_FIGURES if spec.part is part}
    return listed | further_figures() if part is PagePart.STUDY else listed


def further_figures() -> dict[str, PageFigure]:
    """Return the figures of the cohort that the workflow's list alone has, by name."""
    listed = {spec.name for spec in PAGE_FIGURES if spec.part is PagePart.STUDY}
    return {
        figure.name: PageFigure(figure.name, PagePart.STUDY, figure.caption, "{caption}")
        for figure in FIGURES
        if figure.of == "cohort" and figure.name not in listed
    }
