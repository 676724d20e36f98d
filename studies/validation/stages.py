"""The validation: hearts of each generator, answered, and what the answers come to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from pydantic import Field

from studies.validation.answers import HeartAnswersSettings, Questioner
from studies.validation.figure import draw_validation
from studies.validation.score import HeartAnswer, HeartAnswers
from studies.validation.settings import ScoreSettings
from studies.validation.table import samplers_table, validation_table
from swesbi.answers.knowledge import knowledge_of_population
from swesbi.artefacts import Origin
from swesbi.artefacts.csv import write_csv
from swesbi.artefacts.files import hdf5_provenance
from swesbi.base.progress import Progress
from swesbi.base.settings import Settings
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.report.figures.style import save_figure
from swesbi.study.other_network import check_network


def validation_answers(
    *,
    estimator: Path,
    noise: Path,
    null: Path,
    answers: Path,
    settings: HeartAnswersSettings,
    origin: Origin,
) -> None:
    """Answer some hearts of one generator.

    Args:
        estimator: The network of the population.
        noise: Noise of the study's cohort, from which standard errors are told.
        null: Null recordings.
        answers: Output.

    Raises:
        OtherNetworkError: The network was trained under other settings.
        RuntimeError: A heart could not be recorded.
        ArtefactError: An input is no such artefact.
        ValueError: No generator has this letter.
    """
    check_network(estimator, settings.train_population)
    components = CohortNoise.read(noise).usual
    questioner = Questioner(knowledge_of_population(estimator, null), components, settings, origin.seed)
    label = f"{settings.stream}, {settings.generator}: {settings.source.title}"
    progress = Progress(label, settings.hearts, unit="heart")
    answered = []
    for number in settings.numbers:
        answered.append(questioner.answer(number))
        progress.step(note=f"{answered[-1].context.subject} {answered[-1].status}")
    HeartAnswers(tuple(answered)).write(answers, origin.provenance("", settings))


class ValidationStageSettings(Settings):
    """What the tables and the figure depend on."""

    score: ScoreSettings
    interval: float = Field(gt=0.0, lt=1.0, description="mass of the credible intervals")


def validation(
    *,
    answers: Sequence[Path],
    table: Path,
    samplers: Path,
    figure_pdf: Path,
    figure_png: Path,
    settings: ValidationStageSettings,
    origin: Origin,
) -> None:
    """Write what the answers of all generators come to: coverage by quantity, samplers, a figure.

    Args:
        answers: Of each generator, in one file or several.
        table: Output, one row a generator and quantity.
        samplers: Output, one row a generator.
        figure_pdf: Output, coverage.
        figure_png: Output, the same.

    Raises:
        ArtefactError: A file holds no answers.
    """
    by_letter, titles = _by_letter(answers)
    frame = validation_table(by_letter, titles, settings.score)
    write_csv(table, frame)
    write_csv(samplers, samplers_table(by_letter, titles))
    save_figure(draw_validation(frame, settings.interval), figure_pdf, figure_png)


def _by_letter(answers: Sequence[Path]) -> tuple[Mapping[str, list[HeartAnswer]], Mapping[str, str]]:
    """Return the answers of each generator, heart by heart, and its title, by letter in order."""
    found: dict[str, list[HeartAnswer]] = {}
    titles: dict[str, str] = {}
    read = [(_settings_of(path), path) for path in answers]
    for settings, path in sorted(read, key=lambda item: (item[0].generator, item[0].first)):
        found.setdefault(settings.generator, []).extend(HeartAnswers.read(path).of)
        titles[settings.generator] = settings.source.title
    return found, titles


def _settings_of(path: Path) -> HeartAnswersSettings:
    return HeartAnswersSettings.from_plain(dict(hdf5_provenance(path).settings))
