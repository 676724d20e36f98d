"""Hearts of one generator, answered as any subject outside the study is."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path

from pydantic import Field

from studies.validation.score import HeartAnswer, intervals, refusal, truths
from studies.validation.settings import answers_settings, configured
from swesbi.config.study import Study
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import measured_speeds
from swesbi.networks.flow.files import load_flow
from swesbi.networks.flow.flow import flow_proposal
from swesbi.population.settings import PopulationSettings, in_declared_range
from swesbi.posterior.importance import NoLikelihoodError
from swesbi.posterior.result import ExactResult, read_exact_result
from swesbi.prior import PriorSettings
from swesbi.recording.acquisition_settings import AcquisitionSettings
from swesbi.recording.noise import read_noise
from swesbi.recording.protocol import Repeats
from swesbi.recording.settings import RecordingSettings
from swesbi.study.stages.answers import Answer, AnswerSettings, Knowledge
from swesbi.study.stages.flow_training import TrainPopulationStageSettings
from swesbi.study.stages.new_subject import STREAM, noise_test_of
from swesbi.study.stages.origin import Origin
from swesbi.verdict.answers import SEPARATOR, label_of_test
from swesbi.verdict.pooled import read_null
from swesbi.verdict.verdict import CONTRADICTED, Verdict, VerdictTest
from swesbi.virtual.hearts.generators import all_generators, generator_of
from swesbi.virtual.hearts.heart import Generator
from swesbi.virtual.hearts.recorded import RecordedHeart, record_heart


class HeartAnswersSettings(AnswerSettings):
    """Which hearts are asked for, what they are made of, and all that answers depend on.

    The acquisition is that of every generator that says no other.
    """

    generator: str = Field(min_length=1, description="letter of the generator")
    stream: str = Field(min_length=1, description="name of its random streams")
    first: int = Field(ge=0, description="number of the first heart")
    hearts: int = Field(ge=1, description="how many hearts")
    prior: PriorSettings
    acquisition: AcquisitionSettings
    recording: RecordingSettings
    grid_points: int
    population: PopulationSettings
    train_population: TrainPopulationStageSettings
    reference_recordings: int = Field(ge=100, description="prior predictive recordings of the heart")
    noise_level: float = Field(gt=0.0, lt=0.5, description="of the test that the noise is the cohort's")

    @property
    def numbers(self) -> range:
        """The numbers of the hearts."""
        return range(self.first, self.first + self.hearts)

    @property
    def source(self) -> Generator:
        """The generator.

        Raises:
            ValueError: No generator has this letter.
        """
        measured = self.verdict.rule.volumes.lvesv_tolerance_fraction
        generators = all_generators(self.population, self.prior, self.acquisition, measured)
        return generator_of(generators, self.generator)

    def recorded(self, number: int, seed: int) -> RecordedHeart:
        """Draw and record the heart of this number.

        Raises:
            RuntimeError: It could not be recorded.
        """
        return record_heart(self.source, number, seed, self.stream, self.recording, self.grid_points)


def asked_of(study: Study, generator: str, hearts: int, stream: str) -> HeartAnswersSettings:
    """Return how the first hearts of a generator are made and answered, as config.yaml configures it.

    Raises:
        ConfigError: The study has no such experiment over a population.
    """
    plain = answers_settings(study, configured().experiment, generator, stream, range(hearts))
    return HeartAnswersSettings.from_plain(plain)


@dataclass(frozen=True)
class Questioner:
    """Asks the network of a population about hearts; what it reads is read once.

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
    settings: HeartAnswersSettings
    origin: Origin

    def answer(self, number: int) -> HeartAnswer:
        """Draw, record and answer the heart of this number.

        Raises:
            RuntimeError: It could not be recorded.
            ArtefactError: An input is no such artefact.
        """
        made = self.settings.recorded(number, self.origin.seed)
        if outside := in_declared_range(made.heart.context, self.settings.population):
            return refusal(number, made.heart, made.redrawn, SEPARATOR.join(outside))
        try:
            first = self._of_one_round()._answer(number, made)
            if first.converged or first.status == CONTRADICTED:
                return first
            return self._answer(number, made)
        except NoLikelihoodError as error:
            return refusal(number, made.heart, made.redrawn, str(error))

    def _of_one_round(self) -> Questioner:
        """Return the same, whose chains end after one round; weights and chains that converge give the same.

        Chains of a heart that the model cannot be take minutes and do not converge. Where one round of them
        contradicts the model, they go no further.
        """
        inference = self.settings.exact_posterior
        mcmc = inference.exact.mcmc.model_copy(update={"max_steps": inference.exact.mcmc.steps})
        exact = inference.exact.model_copy(update={"mcmc": mcmc})
        shorter = inference.model_copy(update={"exact": exact})
        return replace(self, settings=self.settings.model_copy(update={"exact_posterior": shorter}))

    def _answer(self, number: int, made: RecordedHeart) -> HeartAnswer:
        with tempfile.TemporaryDirectory(prefix="swesbi-validation-") as folder:
            posterior, verdict = Path(folder) / "posterior.h5", Path(folder) / "verdict.json"
            answer, judged = self._judged(made, posterior, verdict)
            exact = read_exact_result(posterior)
        reason = SEPARATOR.join(label_of_test(test.name) for test in judged.tests if test.flagged)
        return scored(made, answer.model, exact, number, judged.status, reason)

    def _judged(self, made: RecordedHeart, posterior: Path, verdict: Path) -> tuple[Answer, Verdict]:
        """Infer and judge a recording as that of any subject outside the study, under the same streams."""
        settings = self.settings
        recording = measured_speeds(made.observation, read_noise(self.noise).components)
        model = SpeedModel(recording, settings.exact_posterior.model)
        origin = Origin(self.origin.seed, recording.subject, self.origin.code_hash)
        answer = Answer(model, knowledge_of(self.estimator, self.null), settings, origin, STREAM)
        efficiency = answer.infer(posterior)
        reference = answer.reference(settings.reference_recordings)
        return answer, answer.judge(posterior, verdict, reference, efficiency, [self._noise_test(made)])

    def _noise_test(self, made: RecordedHeart) -> VerdictTest:
        settings, components = self.settings, read_noise(self.noise).components
        swept = settings.source.acquisition.sweep_fraction > 0.0
        repeats: Repeats = "sweeps" if swept else "separate"
        return noise_test_of(made.samples, repeats, components, settings.recording, settings.noise_level)


@lru_cache(maxsize=1)
def knowledge_of(estimator: Path, null: Path) -> Knowledge:
    """Read what answers all hearts, once a process.

    Raises:
        ArtefactError: A file is no such artefact.
    """
    flow, population = load_flow(estimator)[0], read_null(null)
    return Knowledge(partial(flow_proposal, flow), population.contexts, lambda: population.pooled)


def scored(
    made: RecordedHeart, model: SpeedModel, exact: ExactResult, number: int, verdict: str, reason: str
) -> HeartAnswer:
    """Return the intervals of a posterior beside the truths of the heart."""
    found = intervals(model, exact.phi, exact.interval_mass)
    return HeartAnswer(
        number, made.heart.context, made.redrawn, verdict, reason,
        by_mcmc=exact.by_mcmc, converged=exact.converged, efficiency=exact.efficiency,
        truth=truths(made.heart), **vars(found),
    )  # fmt: skip
