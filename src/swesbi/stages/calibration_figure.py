"""Stage: the figure of an experiment's calibration."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from swesbi.artefacts import ArtefactError, load
from swesbi.calibration.dataset import KIND, diagnostics_of, ranked_of
from swesbi.calibration.settings import JudgementSettings
from swesbi.calibration.table import COLUMNS, LOCAL
from swesbi.settings import Settings
from swesbi.show.figures.calibration import CalibrationCase, draw_calibration
from swesbi.show.figures.style import save_figure
from swesbi.stages.origin import Origin


class CalibrationFigureSettings(Settings):
    """What is asked of the posteriors, and what the figure calls the subjects and the experiment."""

    judgement: JudgementSettings
    max_k_hat: float
    experiment: str
    cohort_title: str


def run(
    *,
    calibration: Path,
    table: Path,
    figure_pdf: Path,
    figure_png: Path,
    settings: CalibrationFigureSettings,
    origin: Origin,
) -> None:
    """Draw ranks, coverage, weights and local calibration.

    Raises:
        ArtefactError: A file is no such result.
    """
    groups = {name: load(calibration, KIND, name)[0] for name in ("own", "acquired", LOCAL)}
    checks = pd.read_csv(table)
    if missing := [name for name in COLUMNS if name not in checks.columns]:
        raise ArtefactError(f"{table}: lacks the columns {', '.join(missing)}; delete it and rerun")
    case = CalibrationCase(
        ranked={name: ranked_of(group) for name, group in groups.items()},
        diagnostics=diagnostics_of(groups["own"]),
        table=checks,
        settings=settings.judgement,
        max_k_hat=settings.max_k_hat,
    )
    save_figure(draw_calibration(case, settings.cohort_title, settings.experiment), figure_pdf, figure_png)
