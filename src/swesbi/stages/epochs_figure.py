"""Stage: loss, recovery, observed coverage and posterior width of an experiment against the epoch."""

from __future__ import annotations

from pathlib import Path

from swesbi.settings import Settings
from swesbi.show.figures.style import save_figure
from swesbi.show.figures.training import draw_epochs, read_epochs, read_history
from swesbi.stages.origin import Origin


class EpochsFigureSettings(Settings):
    """What the figure calls the subjects and the experiment, and the mass of its intervals."""

    cohort_title: str
    experiment: str
    interval: float


def run(
    *,
    epochs: Path,
    training: Path,
    figure_pdf: Path,
    figure_png: Path,
    settings: EpochsFigureSettings,
    origin: Origin,
) -> None:
    """Draw the four panels."""
    figure = draw_epochs(
        read_epochs(epochs),
        read_history(training),
        settings.interval,
        settings.cohort_title,
        settings.experiment,
    )
    save_figure(figure, figure_pdf, figure_png)
