"""The figure of the posterior of a cohort."""

from __future__ import annotations

from pathlib import Path

from swesbi.artefacts import Origin
from swesbi.base.settings import Settings
from swesbi.persons.cohort.result import read_cohort_posterior
from swesbi.report.figures.cohort_posterior import draw_cohort_posterior
from swesbi.report.figures.style import save_figure


class CohortPosteriorFigureSettings(Settings):
    """What the figure calls the subjects."""

    cohort_title: str


def cohort_posterior_figure(
    *,
    cohort_posterior: Path,
    figure_pdf: Path,
    figure_png: Path,
    settings: CohortPosteriorFigureSettings,
    origin: Origin,
) -> None:
    """Draw every subject before and after the population is taken into account, and the groups.

    Raises:
        ArtefactError: The file is not the posterior of a cohort.
    """
    posterior = read_cohort_posterior(cohort_posterior)
    save_figure(draw_cohort_posterior(posterior, settings.cohort_title), figure_pdf, figure_png)
