"""Stage: the table and the figure of what each variant changes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from swesbi.sensitivity.posteriors import read_posteriors
from swesbi.sensitivity.table import sensitivity_table
from swesbi.settings import Settings
from swesbi.show.csv import write_csv
from swesbi.show.figures.choices import draw_sensitivity
from swesbi.show.figures.style import save_figure
from swesbi.stages.origin import Origin


class SensitivityStageSettings(Settings):
    """What the table and the figure call things; ``labels`` by variant, in the order shown."""

    cohort_title: str
    interval: float
    labels: dict[str, str]


def run(
    *,
    variants: Sequence[Path],
    table: Path,
    figure_pdf: Path,
    figure_png: Path,
    settings: SensitivityStageSettings,
    origin: Origin,
) -> None:
    """Write how far medians and intervals move under each variant; each file is named by its variant."""
    files = {path.stem: path for path in variants}
    posteriors = {name: read_posteriors(files[name]) for name in settings.labels}
    frame = sensitivity_table(posteriors, settings.labels, settings.interval)
    write_csv(table, frame)
    save_figure(draw_sensitivity(frame, settings.cohort_title), figure_pdf, figure_png)
