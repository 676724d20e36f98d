"""Stage: the figures of one subject, predictive check and posterior."""

from __future__ import annotations

from pathlib import Path

from swesbi.evaluation.cmaes_dataset import read_cmaes
from swesbi.evaluation.predictive_dataset import read_predictive
from swesbi.inference.dataset import read_posterior
from swesbi.inference.support import read_support
from swesbi.settings import Settings
from swesbi.show.figures.posterior_subject import draw_subject_posterior
from swesbi.show.figures.predictive import PosteriorPanel, PredictivePanel, draw_subject_check
from swesbi.show.figures.style import save_figure
from swesbi.simulations.prior import PriorSettings
from swesbi.stages.origin import Origin


class SubjectFiguresSettings(Settings):
    """What the figures call the subjects, and the prior shown for scale."""

    cohort_title: str
    prior: PriorSettings


def run(
    *,
    predictive: Path,
    posterior: Path,
    support: Path,
    cmaes: Path,
    ppc_png: Path,
    posterior_png: Path,
    settings: SubjectFiguresSettings,
    origin: Origin,
) -> None:
    """Draw predictive check and posterior."""
    save_predictive_check(predictive, support, cmaes, ppc_png, settings.cohort_title)
    draws = read_posterior(posterior)
    fit, provenance = read_cmaes(cmaes)
    panel = PosteriorPanel(
        provenance.subject, draws.theta, draws.unfiltered, fit.theta, read_support(support)
    )
    drawn = draw_subject_posterior(panel, settings.prior, draws.interval_mass, settings.cohort_title)
    save_figure(drawn, posterior_png)


def save_predictive_check(
    predictive: Path, support: Path, cmaes: Path, figure: Path, cohort_title: str
) -> None:
    """Draw the predictive check of any experiment; ``figure`` is a .png or .pdf."""
    check, provenance = read_predictive(predictive)
    fit, _ = read_cmaes(cmaes)
    panel = PredictivePanel(provenance.subject, check, fit, read_support(support))
    save_figure(draw_subject_check(panel, cohort_title), figure)
