"""The exam: hearts of each generator, answered as any subject outside the study is, and what they come to."""

from __future__ import annotations

import logging
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from functools import lru_cache, partial
from multiprocessing import get_context
from pathlib import Path
from typing import Final, Protocol

from pydantic import Field

from swesbi.arrays import FloatArray
from swesbi.artefacts import load, save
from swesbi.exam.generators import all_generators, generator_of
from swesbi.exam.heart import Generator
from swesbi.exam.noise import noisier
from swesbi.exam.recorded import RecordedHeart, record_heart
from swesbi.exam.score import KIND, HeartAnswer, intervals, read_answers, refusal, to_dataset, truths
from swesbi.exam.settings import MadeSettings, NoiseLevel
from swesbi.heart.simulate import Beats
from swesbi.measurement.likelihood import speed_model
from swesbi.measurement.settings import ClinicalSettings
from swesbi.measurement.speeds import measured_speeds
from swesbi.networks.spline.files import load_spline
from swesbi.networks.spline.flow import flow_proposal
from swesbi.population.settings import PopulationSettings, in_declared_range
from swesbi.posterior.importance import NoLikelihoodError
from swesbi.posterior.result import ExactResult, read_exact_result
from swesbi.prior import JointPriorSettings, PriorSettings
from swesbi.progress import Progress
from swesbi.recording.noise import read_noise
from swesbi.recording.protocol import Repeats
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.study.stages.answers import Answer, AnswerSettings, Knowledge
from swesbi.study.stages.flow_training import TrainPopulationStageSettings
from swesbi.study.stages.new_subject import STREAM, noise_test_of, one_thread
from swesbi.study.stages.origin import Origin
from swesbi.study.stages.other_network import check_network
from swesbi.verdict.answers import SEPARATOR, label_of_test, status
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

    def recorded(self, number: int, seed: int) -> RecordedHeart:
        """Draw and record the heart of this number.

        Raises:
            RuntimeError: It could not be recorded.
        """
        return record_heart(
            self.source, number, seed, self.stream, self.recording, self.grid_points, self.clinical.errors
        )


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
        return self.settings.recorded(number, self.origin.seed)

    def origin_of(self, subject: str) -> Origin:
        """Return the origin of what is made of a heart's recording."""
        return Origin(self.origin.seed, subject, self.origin.code_hash)

    def _answer(self, number: int, made: RecordedHeart) -> HeartAnswer:
        with tempfile.TemporaryDirectory(prefix="swesbi-exam-") as folder:
            posterior, support = Path(folder) / "posterior.h5", Path(folder) / "support.json"
            answer, judged = self._judged(made, posterior, support)
            exact = read_exact_result(posterior)
        reason = SEPARATOR.join(label_of_test(test.name) for test in judged.tests if test.flagged)
        return scored(made, answer.model, exact, number, status(judged), reason)

    def _judged(self, made: RecordedHeart, posterior: Path, support: Path) -> tuple[Answer, Support]:
        """Infer and judge a recording as that of any subject outside the study, under the same streams."""
        settings = self.settings
        recording = measured_speeds(made.observation, self.components())
        model = speed_model(recording, settings.exact_posterior.model)
        answer = Answer(model, self._knowledge(), settings, self.origin_of(recording.subject), STREAM)
        efficiency = answer.infer(posterior)
        reference = answer.reference(settings.reference_recordings)
        return answer, answer.judge(posterior, support, reference, efficiency, [self._noise_test(made)])

    def components(self) -> NoiseComponents:
        """Return the noise of a cohort that is recorded as its hearts are: the study's, times the factor."""
        return read_noise(self.noise).components.times(self.settings.noise_factor)

    def _knowledge(self) -> Knowledge:
        return _knowledge_of(self.estimator, self.null, self.null.stat().st_mtime_ns)

    def _noise_test(self, made: RecordedHeart) -> SupportTest:
        settings, components = self.settings, self.components()
        swept = settings.source.acquisition.sweep_fraction > 0.0
        repeats: Repeats = "sweeps" if swept else "separate"
        return noise_test_of(made.samples, repeats, components, settings.recording, settings.noise_level)


@lru_cache(maxsize=1)
def _knowledge_of(estimator: Path, null: Path, written_ns: int) -> Knowledge:
    """Read what answers all hearts, once a process for files as they were ``written_ns``."""
    flow, population = load_spline(estimator)[0], read_null(null)
    return Knowledge(partial(flow_proposal, flow), population.contexts, lambda: population.pooled)


class HasJointPrior(Protocol):
    """Settings that hold the prior of phi."""

    @property
    def prior(self) -> JointPriorSettings:
        """The prior of theta, passive scale and nuisances."""


class Model(Protocol):
    """What simulates draws of a posterior: the model of speeds, or that of speeds and pressures."""

    @property
    def settings(self) -> HasJointPrior:
        """Hold the prior."""

    def simulate(self, phi: FloatArray) -> Beats:
        """Simulate phi of shape (n, d) in the heart's context; failed rows hold NaN."""


def scored(
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
    answer_missing(answers, examiner, processes)


def answer_missing(path: Path, examiner: Examiner, processes: int, how: str = "") -> None:
    """Answer the hearts that the file does not hold already, made alike, and save every few of them.

    Args:
        path: The file.
        examiner: Answers them.
        processes: Hearts side by side.
        how: What the progress says of the answers, behind a space.

    Raises:
        RuntimeError: A heart could not be recorded.
        ArtefactError: An input is no such artefact.
    """
    settings, origin = examiner.settings, examiner.origin
    done = {answer.number: answer for answer in _kept(path, settings, origin)}
    missing = [number for number in range(settings.hearts) if number not in done]
    label = f"{settings.stream}, {settings.noise} noise{how}, {settings.generator}: {settings.source.title}"
    progress = Progress(label, len(missing), unit="heart")
    for answer in _answered(examiner, missing, processes):
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


def _answered(examiner: Examiner, numbers: Sequence[int], processes: int) -> Iterator[HeartAnswer]:
    """Yield answers as they come."""
    with ProcessPoolExecutor(processes, mp_context=get_context("fork"), initializer=one_thread) as pool:
        futures = [pool.submit(examiner.answer, number) for number in numbers]
        try:
            for future in as_completed(futures):
                yield future.result()
        finally:
            pool.shutdown(cancel_futures=True)
