"""Stage: figure of the misspecification tests: p-values and verdicts, false alarms and power."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from swesbi.artefacts import ArtefactError
from swesbi.inference.support import read_support
from swesbi.misspecification.power import AlarmRow
from swesbi.settings import Settings
from swesbi.show.figures.misspecification import draw_misspecification
from swesbi.show.figures.style import save_figure
from swesbi.stages.origin import Origin
from swesbi.stages.places import by_place


class MisspecificationFigureStageSettings(Settings):
    """What the figure calls the subjects, and the level that the alarms are to keep."""

    cohort_title: str
    strained_level: float


def run(
    *,
    table: Path,
    supports: Sequence[Path],
    figure_pdf: Path,
    figure_png: Path,
    settings: MisspecificationFigureStageSettings,
    origin: Origin,
) -> None:
    """Draw every subject's p-values and verdict, and below them which test catches what.

    Raises:
        ArtefactError: The table lacks a column or a verdict cannot be read.
    """
    verdicts = {place.subject: read_support(path) for place, path in by_place(supports).items()}
    figure = draw_misspecification(
        verdicts, _read_rows(table), settings.strained_level, settings.cohort_title
    )
    save_figure(figure, figure_pdf, figure_png)


def _read_rows(path: Path) -> list[AlarmRow]:
    try:
        table = pd.read_csv(path, dtype={"subject": str, "recordings": str, "alarm": str})
        return [
            AlarmRow(**{str(name): value for name, value in row.items()}) for row in table.to_dict("records")
        ]
    except (OSError, ValueError, TypeError) as error:
        raise ArtefactError(f"{path}: cannot be read as misspecification.csv ({error})") from error
