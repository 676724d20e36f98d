"""The validation: hearts of each generator, answered, and what the answers come to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import pandas as pd

from studies.validation.answers import HeartAnswers, HeartAnswersSettings, Questioner
from studies.validation.figure import draw_validation
from studies.validation.nonsense import COLUMNS, NonsenseQuestioner, nonsense_table, with_fewer_draws
from studies.validation.score import HeartAnswer
from studies.validation.settings import ScoreSettings
from studies.validation.table import samplers_table, validation_table
from swesbi.answers.answer import Knowledge
from swesbi.artefacts import Group, Provenance, UnfitError
from swesbi.artefacts.csv import PlainTable, Table
from swesbi.base.progress import Progress
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.report.figures.style import Drawing
from swesbi.study.results import difference
from swesbi.verdict.null_recordings import NullRecordings


@dataclass(frozen=True)
class FlowOfPopulation(TrainedFlow):
    """The network of a population, and the settings of its training; no rule of the side study makes it."""

    trained_under: Mapping[str, Any]

    @classmethod
    def rebuilt(cls, groups: Mapping[str, Group], made: Provenance) -> FlowOfPopulation:
        """Return the flow of a file's group."""
        return cls(**vars(TrainedFlow.rebuilt(groups, made)), trained_under=made.settings)


def validation_answers(
    estimator: FlowOfPopulation,
    noise: CohortNoise,
    null: NullRecordings,
    *,
    asked: HeartAnswersSettings,
    seed: int,
) -> HeartAnswers:
    """Answer some hearts of one generator.

    Args:
        noise: Of the study's cohort, from which standard errors are told.
        asked: Which hearts, and how they are answered.

    Raises:
        UnfitError: The network was trained under other settings.
        RuntimeError: A heart could not be recorded.
        ValueError: No generator has this letter.
    """
    questioner = Questioner(_knowledge(estimator, null, asked), noise.usual, asked, seed)
    label = f"{asked.stream}, {asked.generator}: {asked.source.title}"
    progress = Progress(label, asked.hearts, unit="heart")
    answered = []
    for number in asked.numbers:
        answered.append(questioner.answer(number))
        progress.step(note=f"{answered[-1].context.subject} {answered[-1].status}")
    return HeartAnswers(tuple(answered), asked)


def _knowledge(estimator: FlowOfPopulation, null: NullRecordings, asked: HeartAnswersSettings) -> Knowledge:
    if fault := difference(estimator.trained_under, asked.train_population):
        raise UnfitError("estimator", fault)
    return Knowledge(null, estimator)


def nonsense_answers(
    estimator: FlowOfPopulation,
    noise: CohortNoise,
    null: NullRecordings,
    *,
    asked: HeartAnswersSettings,
    seed: int,
) -> PlainTable:
    """Answer curves that no heart makes, of some hearts; a row a change and form of recording.

    Args and what is raised: as :func:`validation_answers`.
    """
    fewer = with_fewer_draws(asked)
    questioner = NonsenseQuestioner(_knowledge(estimator, null, asked), noise.usual, fewer, seed)
    progress, rows = Progress("nonsense", asked.hearts, unit="heart"), list[dict[str, object]]()
    for number in asked.numbers:
        rows += questioner.rows(number)
        progress.step()
    return pd.DataFrame(rows, columns=list(COLUMNS))


def nonsense(rows: tuple[Annotated[pd.DataFrame, Table(COLUMNS)], ...]) -> PlainTable:
    """Count what is said of each change and form of recording."""
    return nonsense_table(pd.concat(rows))


class Validation(NamedTuple):
    """What the answers come to: a row a generator and quantity, a row a generator, coverage by quantity."""

    table: PlainTable
    samplers: PlainTable
    figure: Drawing


def validation(answers: tuple[HeartAnswers, ...], *, score: ScoreSettings, interval: float) -> Validation:
    """Count the answers of all generators.

    Args:
        answers: Of each generator, in one file or several.
        interval: Mass of the credible intervals.
    """
    by_letter: dict[str, list[HeartAnswer]] = {}
    titles: dict[str, str] = {}
    for part in sorted(answers, key=lambda part: (part.asked.generator, part.asked.first)):
        by_letter.setdefault(part.asked.generator, []).extend(part.of)
        titles[part.asked.generator] = part.asked.source.title
    table = validation_table(by_letter, titles, score)
    return Validation(table, samplers_table(by_letter, titles), draw_validation(table, interval))
