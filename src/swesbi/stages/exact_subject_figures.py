"""Stage: the figures of one subject in an experiment on speeds, predictive check and exact posterior."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from swesbi.evaluation.cmaes_dataset import read_cmaes
from swesbi.evaluation.exact_result import read_exact_result
from swesbi.evaluation.truth import read_truth
from swesbi.inference.support import read_support
from swesbi.settings import Settings
from swesbi.show.figures.posterior_subject import draw_exact_subject
from swesbi.show.figures.predictive import ExactPanel
from swesbi.show.figures.style import save_figure
from swesbi.speed_model.joint_prior import JointPriorSettings
from swesbi.stages.origin import Origin
from swesbi.stages.subject_figures import save_predictive_check


class ExactSubjectFiguresSettings(Settings):
    """What the figures call the subjects, and the joint prior shown for scale."""

    cohort_title: str
    prior: JointPriorSettings


def run(
    *,
    predictive: Path,
    posterior: Path,
    support: Path,
    cmaes: Path,
    truth: Sequence[Path],
    ppc_png: Path,
    posterior_png: Path,
    settings: ExactSubjectFiguresSettings,
    origin: Origin,
) -> None:
    """Draw predictive check and posterior.

    ``truth`` is the file of true parameters of a generated cohort, or nothing.
    """
    save_predictive_check(predictive, support, cmaes, ppc_png, settings.cohort_title)
    save_exact_posterior(posterior, support, cmaes, truth, posterior_png, settings)


def save_exact_posterior(
    posterior: Path,
    support: Path,
    cmaes: Path,
    truth: Sequence[Path],
    figure: Path,
    settings: ExactSubjectFiguresSettings,
) -> None:
    """Draw the exact posterior; ``figure`` is a .png or .pdf, ``truth`` as in ``run``."""
    fit, provenance = read_cmaes(cmaes)
    subject = provenance.subject
    panel = ExactPanel(
        subject=subject,
        result=read_exact_result(posterior),
        fit_theta=fit.theta,
        support=read_support(support),
        truth=read_truth(truth).get(subject),
    )
    save_figure(draw_exact_subject(panel, settings.prior, settings.cohort_title), figure)
