"""Captions of the page's figures, and what they say to who cannot see them: (description, caption)."""

from __future__ import annotations

from typing import Final

from swesbi.show.results import Experiment

Texts = tuple[str, str]


def workflow(cohort_title: str) -> Texts:
    """Return the texts of figure 1."""
    description = (
        f"Diagram of the workflow, from prior and recording to posterior, with data of {cohort_title}"
    )
    caption = (
        "Figure 1. The workflow, drawn from this run: prior samples and context give simulated curves, "
        f"whose features train the network; the observed features of one subject give its "
        f"posterior ({cohort_title})."
    )
    return description, caption


def ppc(main: Experiment, cohort_title: str) -> Texts:
    """Return the texts of figure 2."""
    description = (
        f"Stiffness over the cardiac cycle, one panel a subject of the {cohort_title}: observed with "
        "standard errors, prior and posterior predictive medians and bands, and the CMA-ES fit"
    )
    caption = (
        f"Figure 2. Predictive checks of each subject ({cohort_title}): observed stiffness with its standard "
        f"error, medians and {main.predictive_percent:g} % bands of the prior and the posterior prediction, "
        "CMA-ES fit. "
        f"{_unsupported(main)}"
    )
    return description, caption.rstrip()


def posterior(main: Experiment, cohort_title: str) -> Texts:
    """Return the texts of figure 3."""
    description = (
        f"Marginal posterior distributions of the three parameters of the {cohort_title}, with "
        "medians, credible intervals, the prior and the CMA-ES estimates"
    )
    caption = (
        f"Figure 3. Posterior of the three parameters of each subject ({cohort_title}), with medians and "
        f"{main.credible_percent:g} % credible intervals, beside the CMA-ES fit. {_unsupported(main)}"
    )
    return description, caption.rstrip()


def experiments(cohort_title: str) -> Texts:
    """Return the texts of the figure of all experiments."""
    description = (
        f"RMSE, coverage and contraction rate of every experiment, subject by subject, {cohort_title}"
    )
    caption = (
        "Predictive error, coverage and contraction rate of every experiment, beside each other "
        f"({cohort_title})."
    )
    return description, caption


def epochs(main: Experiment, cohort_title: str) -> Texts:
    """Return the texts of the figure of inference by epoch."""
    description = (
        "Four panels against the epoch of training: loss, recovery coverage, coverage of the recordings by "
        f"the predictive band, and relative posterior standard deviation; {cohort_title}"
    )
    caption = (
        f"Inference by epoch of training, experiment {main.name} ({cohort_title}): losses, what credible "
        "intervals cover on synthetic recordings, what predictive bands cover of the recordings, and how "
        "wide the posteriors are."
    )
    return description, caption


def training(stem: str, cohort_title: str) -> Texts:
    """Return the texts of a training figure, whose file's name ends in its experiment."""
    experiment = stem.removeprefix("training-")
    description = f"Training and validation loss against epoch, experiment {experiment}, {cohort_title}"
    return description, f"Training and validation loss of the experiment {experiment} ({cohort_title})."


def of_experiment(kind: str, experiment: str, cohort_title: str) -> Texts:
    """Return the texts of a figure of an experiment on speeds, by the figure's kind."""
    caption = _OF_EXPERIMENT.get(kind, kind.replace("_", " ").capitalize())
    return f"{caption} Experiment {experiment}, {cohort_title}", f"{caption} ({cohort_title})."


def of_population(kind: str, experiment: str, cohort_title: str) -> Texts:
    """Return the texts of a figure of an experiment over a population, by the figure's kind."""
    caption = _OF_POPULATION[kind]
    whose = cohort_title if kind == "cohort" else f"contexts of the population of {experiment}"
    return f"{caption} Experiment {experiment}, {whose}", f"{caption} ({whose})."


_OF_POPULATION: Final = {
    "cohort": "Every answer of the cohort, a row a parameter: medians with intervals in ascending order, by "
    "verdict; against heart rate, age and end-diastolic volume; against the truth where it is known. Below: "
    "verdicts, what speaks against the model, efficiency of the weights",
    "strata": "Coverage of credible intervals by stratum, of the network alone and of the exact posterior, "
    "and efficiency of the weights",
    "training": "Training and validation loss of the network",
}
_OF_EXPERIMENT: Final = {
    "noise": "Noise of the measured speeds: components of the cohort and of each recording alone",
    "ppc": "Predictive checks: observed stiffness with its standard error, predictive medians within bands "
    "of new recordings, noise and model discrepancy included",
    "posterior": "Exact posteriors by verdict, the network's own draws as outlines, and the reliability of "
    "the importance weights",
    "calibration": "Calibration: ranks, coverage and joint coverage on recordings of known parameters",
    "misspecification": "Misspecification: p-values of every test, and alarms on recordings of known origin",
    "identifiability": "What a recording tells: exact likelihood along two parameters, and what is lost "
    "without a phase",
    "design": "What more repeats or more phases would buy",
}


def _unsupported(main: Experiment) -> str:
    names = [subject for subject, support in main.supports.items() if not support.supported]
    return f"Outside the prior's support, and greyed: {', '.join(names)}." if names else ""
