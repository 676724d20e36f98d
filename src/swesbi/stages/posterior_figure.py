"""Stage: the figure of one subject's posterior."""

from __future__ import annotations

from pathlib import Path

from swesbi.evaluation.cmaes_dataset import read_cmaes
from swesbi.figures import posterior_subject
from swesbi.figures.panels import PosteriorPanel
from swesbi.figures.style import save_figure
from swesbi.inference.dataset import read_posterior
from swesbi.inference.support import read_support
from swesbi.settings import Settings
from swesbi.simulations.prior import PriorSettings
from swesbi.stages.origin import Origin


class PosteriorFigureSettings(Settings):
    """What the figure calls the subjects, and the prior that it shows for scale."""

    cohort_title: str
    prior: PriorSettings


def run(
    *,
    posterior: Path,
    support: Path,
    cmaes: Path,
    figure: Path,
    settings: PosteriorFigureSettings,
    origin: Origin,
) -> None:
    """Draw the posterior; ``figure`` is a .png or .pdf."""
    draws = read_posterior(posterior)
    fit, provenance = read_cmaes(cmaes)
    panel = PosteriorPanel(
        provenance.subject, draws.theta, draws.unfiltered, fit.theta, read_support(support)
    )
    drawn = posterior_subject.draw(panel, settings.prior, draws.interval_mass, settings.cohort_title)
    save_figure(drawn, figure)
