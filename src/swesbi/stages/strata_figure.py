"""Stage: the figure of calibration by stratum of an experiment over a population."""

from __future__ import annotations

from pathlib import Path

from swesbi.settings import Settings
from swesbi.show.figures.population import draw_strata, read_strata
from swesbi.show.figures.style import save_figure
from swesbi.stages.origin import Origin


class StrataFigureSettings(Settings):
    """What the figure shows of the table, and whose it is.

    Attributes:
        experiment: Name of the experiment.
        interval: Nominal level of the credible intervals shown.
    """

    experiment: str
    interval: float


def run(
    *, strata: Path, figure_pdf: Path, figure_png: Path, settings: StrataFigureSettings, origin: Origin
) -> None:
    """Draw coverage and efficiency by stratum.

    Raises:
        ArtefactError: The table is not one of strata.
    """
    drawn = draw_strata(read_strata(strata), settings.interval, settings.experiment)
    save_figure(drawn, figure_pdf, figure_png)
