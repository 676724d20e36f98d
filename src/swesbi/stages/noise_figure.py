"""Stage: the figure of the variance components, of each recording and of the cohort."""

from __future__ import annotations

from pathlib import Path

from swesbi.noise.dataset import read_noise
from swesbi.settings import Settings
from swesbi.show.figures.recording import draw_noise
from swesbi.show.figures.style import save_figure
from swesbi.stages.origin import Origin


class NoiseFigureSettings(Settings):
    """What the figure calls the subjects."""

    cohort_title: str


def run(
    *, noise: Path, figure_pdf: Path, figure_png: Path, settings: NoiseFigureSettings, origin: Origin
) -> None:
    """Draw both components."""
    save_figure(draw_noise(read_noise(noise), settings.cohort_title), figure_pdf, figure_png)
