"""Stage: training and validation loss of an experiment's estimator, epoch by epoch."""

from __future__ import annotations

from pathlib import Path

from swesbi.settings import Settings
from swesbi.show.figures.style import save_figure
from swesbi.show.figures.training import draw_training, read_history
from swesbi.stages.origin import Origin


class TrainingFigureSettings(Settings):
    """What the figure calls the subjects."""

    cohort_title: str


def run(
    *,
    training: Path,
    figure_pdf: Path,
    figure_png: Path,
    settings: TrainingFigureSettings,
    origin: Origin,
) -> None:
    """Draw the loss curves."""
    history = read_history(training)
    save_figure(draw_training(history, settings.cohort_title), figure_pdf, figure_png)
