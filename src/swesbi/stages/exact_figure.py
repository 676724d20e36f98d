"""Stage: the figure of one subject's exact posterior."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from swesbi.evaluation.cmaes_dataset import read_cmaes
from swesbi.evaluation.exact_result import read_exact_result
from swesbi.evaluation.truth import read_truth
from swesbi.figures import exact_subject
from swesbi.figures.panels import ExactPanel
from swesbi.figures.style import save_figure
from swesbi.inference.support import read_support
from swesbi.settings import Settings
from swesbi.speed_model.joint_prior import JointPriorSettings
from swesbi.stages.origin import Origin


class ExactFigureSettings(Settings):
    """What the figure calls the subjects, and the joint prior that it shows for scale."""

    cohort_title: str
    prior: JointPriorSettings


def run(
    *,
    posterior: Path,
    support: Path,
    cmaes: Path,
    truth: Sequence[Path],
    figure: Path,
    settings: ExactFigureSettings,
    origin: Origin,
) -> None:
    """Draw the posterior; ``figure`` is a .png or .pdf.

    ``truth`` is the file of true parameters of a generated cohort, or nothing.
    """
    fit, provenance = read_cmaes(cmaes)
    subject = provenance.subject
    panel = ExactPanel(
        subject=subject,
        result=read_exact_result(posterior),
        fit_theta=fit.theta,
        support=read_support(support),
        truth=read_truth(truth).get(subject),
    )
    save_figure(exact_subject.draw(panel, settings.prior, settings.cohort_title), figure)
