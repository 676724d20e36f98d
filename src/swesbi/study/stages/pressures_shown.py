"""What the pressures of a cuff add to the answers of a population's network, in a table and drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from swesbi.artefacts import ArtefactError, Origin, load
from swesbi.artefacts.csv import checked, write_csv
from swesbi.base.settings import Settings
from swesbi.checks.pressures import COLUMNS, Compared, pressures_table_of
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.posterior.result import read_exact_posterior
from swesbi.posterior.truncated import POSTERIOR
from swesbi.recording.observation import Observation
from swesbi.report.figures.pressures import draw_pressures
from swesbi.report.figures.style import save_figure
from swesbi.report.tables.pressures import read_pressures
from swesbi.study.stages.origin import ResultKey, by_key, pick


class PressuresTableSettings(Settings):
    """Nothing of the configuration: the posteriors say what they were made under."""


def pressures_table(
    *,
    observations: Sequence[Path],
    posteriors: Sequence[Path],
    with_pressures: Sequence[Path],
    table: Path,
    settings: PressuresTableSettings,
    origin: Origin,
) -> None:
    """Write what pressures add to each subject that has them: every quantity without and with.

    Args:
        observations: Observed curves, which have contexts and pressures.
        posteriors: On speeds alone.
        with_pressures: With pressures, of the same subjects.
        table: Output.

    Raises:
        ArtefactError: A file is missing, or no such artefact.
    """
    without, recordings = by_key(posteriors), _by_subject(observations)
    compared = (  # one after the other, since posteriors of many subjects fill the memory
        _compared(key, recordings, pick(without, key, "posterior on speeds"), path)
        for key, path in by_key(with_pressures).items()
    )
    write_csv(table, pressures_table_of(compared))


def _by_subject(observations: Sequence[Path]) -> dict[str, Observation]:
    return {observed.subject: observed for observed in map(Observation.read, observations)}


def _compared(
    key: ResultKey, recordings: Mapping[str, Observation], without: Path, with_them: Path
) -> Compared:
    if key.subject not in recordings:
        raise ArtefactError(f"no observed curve of subject {key.subject} is given")
    made = load(with_them, POSTERIOR)[1].settings
    model = SpeedModelSettings.from_plain(made["exact_posterior"]["model"])
    return Compared(
        experiment=key.experiment,
        observation=recordings[key.subject],
        model=model,
        without=read_exact_posterior(without),
        with_them=read_exact_posterior(with_them),
    )


class PressuresFigureSettings(Settings):
    """Which experiment is drawn, and what the figure calls the subjects."""

    experiment: str
    cohort_title: str


def pressures_figure(
    *, table: Path, figure_pdf: Path, figure_png: Path, settings: PressuresFigureSettings, origin: Origin
) -> None:
    """Draw what pressures add, by subject and quantity.

    Raises:
        ArtefactError: The table is no such table, or has no row of the experiment.
    """
    frame = read_pressures(table)
    rows = checked(frame[frame["experiment"] == settings.experiment], table, COLUMNS, row=settings.experiment)
    save_figure(draw_pressures(rows, settings.cohort_title), figure_pdf, figure_png)
