"""The exam: hearts of each generator, answered as any subject outside the study is, and what they come to."""

from __future__ import annotations

import logging
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Final, Protocol

import numpy as np
from pydantic import Field

from swesbi.arrays import FloatArray
from swesbi.artefacts import load, save
from swesbi.base import Settings
from swesbi.exam.generators import all_generators, generator_of
from swesbi.exam.heart import Generator
from swesbi.exam.noise import noisier
from swesbi.exam.recorded import RecordedHeart, record_heart
from swesbi.exam.score import KIND, HeartAnswer, intervals, read_answers, refusal, to_dataset, truths
from swesbi.exam.settings import MadeSettings, NoiseLevel, ScoreSettings
from swesbi.exam.table import exam_table as table_of
from swesbi.exam.table import samplers_table
from swesbi.heart.simulate import Beats
from swesbi.measurement.clinical import ClinicalModel, ClinicalSettings, with_pressures
from swesbi.measurement.likelihood import speed_model
from swesbi.measurement.speeds import measured_speeds
from swesbi.networks.spline.files import load_spline
from swesbi.population.settings import PopulationSettings, in_declared_range
from swesbi.posterior.importance import HasPrior, NoLikelihoodError, flow_proposal
from swesbi.posterior.result import ExactResult, read_exact_result
from swesbi.prior import PriorSettings
from swesbi.progress import Progress
from swesbi.recording.noise import read_noise
from swesbi.recording.protocol import Repeats
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.show.csv import write_csv
from swesbi.show.figures.exam import draw_exam
from swesbi.show.figures.style import save_figure
from swesbi.study.stages.answers import Answer, AnswerSettings, Knowledge
from swesbi.study.stages.flow_training import TrainPopulationStageSettings
from swesbi.study.stages.new_subject import STREAM, check_network, noise_test_of, one_thread
from swesbi.study.stages.origin import Origin
from swesbi.study.stages.pressures import PressuresStageSettings, infer_with_pressures
from swesbi.verdict.answers import REFUSED, SEPARATOR, label_of_test, status
from swesbi.verdict.pooled import read_null
from swesbi.verdict.support import Support, SupportTest
from swesbi.virtual_cohort.settings import AcquisitionSettings

LOGGER = logging.getLogger("swesbi")
BATCH: Final = 10
"""Answers between two savings."""


class ExamAnswersStageSettings(AnswerSettings):
    """Which hearts are asked for, what they are made of, and all that answers depend on.

    The acquisition, at the level of noise, is that of every generator that says no other.
    """

    generator: str = Field(min_length=1, description="letter of the generator")
    stream: str = Field(min_length=1, description="name of its random streams")
    hearts: int = Field(ge=1, description="number of hearts")
    noise: NoiseLevel = Field(description="level of noise at which they are recorded")
    noise_factor: float = Field(ge=1, description="its errors but that of the scale, over acquisition")
    made: MadeSettings
    prior: PriorSettings
    acquisition: AcquisitionSettings
    recording: RecordingSettings
    grid_points: int
    population: PopulationSettings
    train_population: TrainPopulationStageSettings
    reference_recordings: int = Field(ge=100, description="prior predictive recordings of the heart")
    noise_level: float = Field(gt=0.0, lt=0.5, description="of the test that the noise is the cohort's")
    clinical: ClinicalSettings

    @property
    def source(self) -> Generator:
        """The generator.

        Raises:
            ValueError: No generator has this letter.
        """
        acquisition = noisier(self.acquisition, self.noise_factor)
        measured = self.verdict.rule.volumes.lvesv_tolerance_fraction
        generators = all_generators(self.made, self.population, self.prior, acquisition, measured)
        return generator_of(generators, self.generator)


@dataclass(frozen=True)
class Examiner:
    """Asks the network of a population about hearts; what it reads is read for each of them.

    Attributes:
        estimator: The network.
        noise: Noise of the study's cohort, from which standard errors are told.
        null: Null recordings of the population.
        settings: Of the hearts and the answers.
        origin: Seed and code.
    """

    estimator: Path
    noise: Path
    null: Path
    settings: ExamAnswersStageSettings
    origin: Origin

    def answer(self, number: int) -> HeartAnswer:
        """Draw, record and answer the heart of this number.

        Raises:
            RuntimeError: It could not be recorded.
            ArtefactError: An input is no such artefact.
        """
        made, settings = self.recorded(number), self.settings
        if outside := in_declared_range(made.heart.context, settings.population):
            return refusal(number, made.heart, made.redrawn, SEPARATOR.join(outside))
        try:
            return self._answer(number, made)
        except NoLikelihoodError as error:
            return refusal(number, made.heart, made.redrawn, str(error))

    def recorded(self, number: int) -> RecordedHeart:
        """Draw and record the heart of this number.

        Raises:
            RuntimeError: It could not be recorded.
        """
        settings = self.settings
        return record_heart(
            settings.source,
            number,
            self.origin.seed,
            settings.stream,
            settings.recording,
            settings.grid_points,
            settings.clinical.errors,
        )

    def answer_with_pressures(self, number: int, without: HeartAnswer) -> HeartAnswer:
        """Draw and record the heart of this number, and infer it from speeds and pressures.

        Args:
            number: The number.
            without: Its answer on the speeds alone, whose verdict stands.

        Raises:
            RuntimeError: It could not be recorded.
            ArtefactError: An input is no such artefact.
            ValueError: That answer is of another heart.
        """
        made = self.recorded(number)
        if not np.array_equal(truths(made.heart), without.truth, equal_nan=True):
            raise ValueError(
                f"heart {made.heart.context.subject}: the answer on speeds alone is of another heart, drawn by "
                "other settings or other code; sit the exam without `--pressures` again"
            )
        if without.status == REFUSED:
            return without
        with tempfile.TemporaryDirectory(prefix="swesbi-exam-") as folder:
            posterior = Path(folder) / "with_pressures.h5"
            model = self._informed(made, posterior)
            exact = read_exact_result(posterior)
        return _scored(made, model, exact, number, without.status, without.reason)

    def _informed(self, made: RecordedHeart, posterior: Path) -> ClinicalModel:
        """Infer a recording with its pressures as that of any subject outside the study."""
        stage = PressuresStageSettings(
            exact_posterior=self.settings.exact_posterior, clinical=self.settings.clinical
        )
        speeds = speed_model(
            measured_speeds(made.observation, self._components()), stage.exact_posterior.model
        )
        model = with_pressures(speeds, made.observation.clinical, stage.clinical)
        network = flow_proposal(load_spline(self.estimator)[0], speeds.recording)
        infer_with_pressures(model, network, posterior, stage, self._of(speeds.recording.subject), STREAM)
        return model

    def _of(self, subject: str) -> Origin:
        return Origin(self.origin.seed, subject, self.origin.code_hash)

    def _answer(self, number: int, made: RecordedHeart) -> HeartAnswer:
        with tempfile.TemporaryDirectory(prefix="swesbi-exam-") as folder:
            posterior, support = Path(folder) / "posterior.h5", Path(folder) / "support.json"
            answer, judged = self._judged(made, posterior, support)
            exact = read_exact_result(posterior)
        reason = SEPARATOR.join(label_of_test(test.name) for test in judged.tests if test.flagged)
        return _scored(made, answer.model, exact, number, status(judged), reason)

    def _judged(self, made: RecordedHeart, posterior: Path, support: Path) -> tuple[Answer, Support]:
        """Infer and judge a recording as that of any subject outside the study, under the same streams."""
        settings = self.settings
        recording = measured_speeds(made.observation, self._components())
        model = speed_model(recording, settings.exact_posterior.model)
        answer = Answer(model, self._knowledge(), settings, self._of(recording.subject), STREAM)
        efficiency = answer.infer(posterior)
        reference = answer.reference(settings.reference_recordings)
        return answer, answer.judge(posterior, support, reference, efficiency, [self._noise_test(made)])

    def _components(self) -> NoiseComponents:
        """Return the noise of a cohort that is recorded as its hearts are: the study's, times the factor."""
        return read_noise(self.noise).components.times(self.settings.noise_factor)

    def _knowledge(self) -> Knowledge:
        flow, null = load_spline(self.estimator)[0], read_null(self.null)
        return Knowledge(partial(flow_proposal, flow), null.contexts, lambda: null.pooled)

    def _noise_test(self, made: RecordedHeart) -> SupportTest:
        settings, components = self.settings, self._components()
        swept = settings.source.acquisition.sweep_fraction > 0.0
        repeats: Repeats = "sweeps" if swept else "separate"
        return noise_test_of(made.samples, repeats, components, settings.recording, settings.noise_level)


class Model(Protocol):
    """What simulates draws of a posterior: the model of speeds, or that of speeds and pressures."""

    @property
    def settings(self) -> HasPrior:
        """Hold the prior."""

    def simulate(self, phi: FloatArray) -> Beats:
        """Simulate phi of shape (n, d) in the heart's context; failed rows hold NaN."""


def _scored(
    made: RecordedHeart, model: Model, exact: ExactResult, number: int, verdict: str, reason: str
) -> HeartAnswer:
    """Return the intervals of a posterior beside the truths of the heart."""
    attained_kpa = model.simulate(exact.phi).active_stiffness_kpa.max(axis=1)
    speed_scale = model.settings.prior.column(exact.phi, "speed_scale")
    found = intervals(exact.phi, attained_kpa, speed_scale, exact.interval_mass)
    return HeartAnswer(
        number, made.heart.context, made.redrawn, verdict, reason,
        by_mcmc=exact.by_mcmc, converged=exact.converged, efficiency=exact.efficiency,
        truth=truths(made.heart), **vars(found),
    )  # fmt: skip


def exam_answers(
    *,
    estimator: Path,
    noise: Path,
    null: Path,
    answers: Path,
    settings: ExamAnswersStageSettings,
    origin: Origin,
    processes: int = 1,
) -> None:
    """Answer the hearts of one generator; those that the output holds already, made alike, are kept.

    Args:
        estimator: The network of the population.
        noise: Noise of the study's cohort, from which standard errors are told.
        null: Null recordings of the population.
        answers: Output, written whole after every few hearts.
        processes: Hearts that are answered side by side; no answer depends on it.

    Raises:
        OtherNetworkError: The network was trained under other settings.
        RuntimeError: A heart could not be recorded.
        ArtefactError: An input is no such artefact.
        ValueError: No generator has this letter.
    """
    check_network(estimator, settings.train_population)
    examiner = Examiner(estimator, noise, null, settings, origin)
    _answer_missing(answers, "", settings, origin, processes, lambda _: (examiner.answer,))


def exam_pressures(
    *,
    estimator: Path,
    noise: Path,
    null: Path,
    without: Path,
    answers: Path,
    settings: ExamAnswersStageSettings,
    origin: Origin,
    processes: int = 1,
) -> None:
    """Answer the same hearts from speeds and cuff pressures; verdicts are those of the speeds alone.

    Args:
        estimator: The network of the population.
        noise: Noise of the study's cohort, from which standard errors are told.
        null: Null recordings of the population.
        without: Their answers on the speeds alone.
        answers: Output, written whole after every few hearts.
        processes: Hearts that are answered side by side; no answer depends on it.

    Raises:
        OtherNetworkError: The network was trained under other settings.
        FileNotFoundError: The hearts have not been answered on the speeds alone, or not all of them.
        RuntimeError: A heart could not be recorded.
        ArtefactError: An input is no such artefact.
        ValueError: No generator has this letter, or an answer without pressures is of another heart.
    """
    check_network(estimator, settings.train_population)
    known = _without_pressures(without, settings)
    examiner = Examiner(estimator, noise, null, settings, origin)
    _answer_missing(
        answers,
        " with pressures",
        settings,
        origin,
        processes,
        lambda number: (examiner.answer_with_pressures, known[number]),
    )


def _without_pressures(path: Path, settings: ExamAnswersStageSettings) -> dict[int, HeartAnswer]:
    """Return the answers on the speeds alone, by number.

    Raises:
        FileNotFoundError: They are not there, or not all of them.
        ArtefactError: The file holds no answers.
    """
    first = (
        f"`python -m swesbi exam --stream {settings.stream} --generators {settings.generator} "
        f"--noise {settings.noise}`"
    )
    if not path.is_file():
        raise FileNotFoundError(
            f"{path} does not exist: verdicts are those of the speeds alone; first {first}"
        )
    known = {answer.number: answer for answer in read_answers(path)}
    if missing := [number for number in range(settings.hearts) if number not in known]:
        raise FileNotFoundError(
            f"{path}: heart number {missing[0]} has no answer on the speeds alone, as have {len(missing) - 1} "
            f"others; first {first}"
        )
    return known


Asked = tuple[Callable[..., HeartAnswer], *tuple[HeartAnswer, ...]]
"""What answers a heart by its number, and what it needs besides."""


def _answer_missing(
    path: Path,
    how: str,
    settings: ExamAnswersStageSettings,
    origin: Origin,
    processes: int,
    asked: Callable[[int], Asked],
) -> None:
    """Answer the hearts that the file does not hold already, made alike, and save every few of them."""
    done = {answer.number: answer for answer in _kept(path, settings, origin)}
    missing = [number for number in range(settings.hearts) if number not in done]
    label = f"{settings.stream}, {settings.noise} noise{how}, {settings.generator}: {settings.source.title}"
    progress = Progress(label, len(missing), unit="heart")
    for answer in _answered({number: asked(number) for number in missing}, processes):
        done[answer.number] = answer
        progress.step(note=f"{answer.context.subject} {answer.status}")
        if progress.done % BATCH == 0 or progress.done == len(missing):
            ordered = [done[number] for number in sorted(done)]
            save(path, to_dataset(ordered), origin.provenance(KIND, settings))


def _kept(path: Path, settings: ExamAnswersStageSettings, origin: Origin) -> list[HeartAnswer]:
    """Return the answers that are there, if they were made under these settings and by this code."""
    if not path.is_file():
        return []
    found, wanted = load(path, KIND)[1], origin.provenance(KIND, settings)
    settings_there = {**found.settings, "hearts": settings.hearts}
    if (settings_there, found.code_hash, found.seed) != (wanted.settings, wanted.code_hash, wanted.seed):
        LOGGER.info("%s was made under other settings or by other code, and is made anew", path)
        return []
    return [answer for answer in read_answers(path) if answer.number < settings.hearts]


def _answered(asked: Mapping[int, Asked], processes: int) -> Iterator[HeartAnswer]:
    """Yield answers as they come."""
    with ProcessPoolExecutor(processes, mp_context=get_context("fork"), initializer=one_thread) as pool:
        futures = [pool.submit(answer, number, *given) for number, (answer, *given) in asked.items()]
        try:
            for future in as_completed(futures):
                yield future.result()
        finally:
            pool.shutdown(cancel_futures=True)


class ExamTableStageSettings(Settings):
    """What the tables and the figure depend on."""

    score: ScoreSettings
    interval: float = Field(gt=0.0, lt=1.0, description="mass of the credible intervals")
    pressures: bool = Field(description="whether the answers are those with cuff pressures")


def exam_table(
    *,
    answers: Sequence[Path],
    table: Path,
    samplers: Path,
    figure_pdf: Path,
    figure_png: Path,
    settings: ExamTableStageSettings,
    origin: Origin,
) -> None:
    """Write what the answers of all generators come to: coverage by quantity, samplers, a figure.

    Args:
        answers: Of each generator, at one level of noise.
        table: Output, one row a generator and quantity.
        samplers: Output, one row a generator.
        figure_pdf: Output, coverage.
        figure_png: Output, the same.

    Raises:
        ArtefactError: A file holds no answers.
        ValueError: The files are of several levels of noise.
    """
    by_letter, titles, noise = _by_letter(answers)
    frame = table_of(by_letter, titles, noise, settings.score)
    write_csv(table, frame)
    write_csv(samplers, samplers_table(by_letter, titles, noise))
    save_figure(draw_exam(frame, settings.interval, settings.pressures), figure_pdf, figure_png)


def _by_letter(
    answers: Sequence[Path],
) -> tuple[Mapping[str, list[HeartAnswer]], Mapping[str, str], NoiseLevel]:
    """Return the answers and the title of each generator, by letter in order, and their level of noise."""
    of_path = {path: _settings_of(path) for path in answers}
    levels: list[NoiseLevel] = sorted({settings.noise for settings in of_path.values()})
    if len(levels) != 1:
        raise ValueError(
            f"a table needs answers at one level of noise, found {len(levels)} ({', '.join(levels)}) among "
            f"{', '.join(map(str, answers))}; make a table of each"
        )
    ordered = sorted(of_path.items(), key=lambda item: item[1].generator)
    found = {settings.generator: read_answers(path) for path, settings in ordered}
    return found, {settings.generator: settings.source.title for _, settings in ordered}, levels[0]


def _settings_of(path: Path) -> ExamAnswersStageSettings:
    return ExamAnswersStageSettings.from_plain(dict(load(path, KIND)[1].settings))
