"""Hearts of one generator, answered as any subject outside the study is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from pydantic import Field, JsonValue

from studies.validation.hearts.generators import Generator, all_generators, generator_of
from studies.validation.hearts.recording import RecordedHeart, record_heart
from studies.validation.score import HeartAnswer, intervals, refusal, truths
from studies.validation.settings import answers_settings, configured
from swesbi import artefacts
from swesbi.answers.answer import AnswerSettings, Knowledge, answered
from swesbi.answers.recording import ModelledRecording, noise_test
from swesbi.artefacts.schema import Schema
from swesbi.config.study import Study
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import measured_speeds
from swesbi.population.settings import PopulationSettings, in_declared_range
from swesbi.posterior.importance import NoLikelihoodError
from swesbi.posterior.result import ExactPosterior
from swesbi.prior import PriorSettings
from swesbi.recording.noise.cohort import compare_noise
from swesbi.recording.noise.components import RepeatLevels
from swesbi.recording.noise.sweeps import levels_by
from swesbi.recording.observation import Observation
from swesbi.recording.quality import rejection
from swesbi.recording.samples import ACCEPTED, Samples
from swesbi.recording.settings import AcquisitionSettings, RecordingSettings, Repeats
from swesbi.recording.speed import NoiseComponents
from swesbi.report.tables.validation import QUANTITIES
from swesbi.verdict.summary import SEPARATOR, label_of_test
from swesbi.verdict.verdict import Status

ALONG: Final = "heart"
SCHEMA: Final = artefacts.schema_of(HeartAnswer, ALONG)["/"]


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
    train_population: dict[str, JsonValue]
    noise_level: float = Field(gt=0.0, lt=0.5, description="of the test that the noise is the cohort's")

    @property
    def numbers(self) -> range:
        """The numbers of the hearts."""
        return range(self.first, self.first + self.hearts)

    @property
    def source(self) -> Generator:
        """The generator."""
        measured = self.rule.volumes.lvesv_tolerance_fraction
        generators = all_generators(self.population, self.prior, self.acquisition, measured)
        return generator_of(generators, self.generator)

    def recorded(self, number: int, seed: int) -> RecordedHeart:
        """Draw and record the heart of this number."""
        return record_heart(self.source, number, seed, self.stream, self.recording, self.grid_points)


@dataclass(frozen=True)
class HeartAnswers(artefacts.Artefact, kind="validation_answers"):
    """The answers to some hearts of one generator, at least one; provenance says which and how."""

    of: tuple[HeartAnswer, ...]
    asked: HeartAnswersSettings

    @classmethod
    def schema(cls) -> Schema:
        """Return the one group of the file."""
        return {"/": SCHEMA}

    @classmethod
    def required_labels(cls) -> tuple[artefacts.Labels, ...]:
        """Return the names of the hearts and of the quantities."""
        return (artefacts.Labels(ALONG, "subject"), artefacts.Labels("quantity"))

    def to_groups(self) -> dict[str, artefacts.Group]:
        """Return the content of the file."""
        labels = {
            "subject": (ALONG, [answer.context.subject for answer in self.of]),
            "quantity": list(QUANTITIES),
        }
        return {"/": artefacts.build_group(SCHEMA, artefacts.stacked_values(self.of)["/"], labels)}

    @classmethod
    def rebuilt(cls, groups: Mapping[str, artefacts.Group], made: artefacts.Provenance) -> HeartAnswers:
        """Return what the group of a file holds, which the stage was asked for."""
        names = {"context.subject": [str(name) for name in groups["/"]["subject"].to_numpy()]}
        answers = artefacts.from_rows(HeartAnswer, groups["/"], ALONG, **names)
        return cls(tuple(answers), HeartAnswersSettings.from_plain(made.settings["asked"]))


def asked_of(study: Study, generator: str, hearts: int, stream: str) -> HeartAnswersSettings:
    """Return how the first hearts of a generator are made and answered, as config.yaml configures it."""
    plain = answers_settings(study, configured().experiment, generator, stream, range(hearts))
    return HeartAnswersSettings.from_plain(plain)


@dataclass(frozen=True)
class Questioner:
    """Asks the network of a population about hearts; what it reads is read once.

    Standard errors are estimated from ``noise``, that of the study's cohort.
    """

    knowledge: Knowledge
    noise: NoiseComponents
    settings: HeartAnswersSettings
    seed: int

    def answer(self, number: int) -> HeartAnswer:
        """Draw, record and answer the heart of this number."""
        made = self.settings.recorded(number, self.seed)
        if outside := in_declared_range(made.heart.context, self.settings.population):
            return refusal(number, made.heart, made.redrawn, SEPARATOR.join(outside))
        try:
            first = self._answer(number, made, of_one_round(self.settings))
            if first.converged or first.status == Status.CONTRADICTED:
                return first
            return self._answer(number, made, self.settings)
        except NoLikelihoodError as error:
            return refusal(number, made.heart, made.redrawn, str(error))

    def _answer(self, number: int, made: RecordedHeart, settings: HeartAnswersSettings) -> HeartAnswer:
        """Infer and judge a recording as that of any subject outside the study, under the same streams."""
        recording = recorded_as_answered(made.observation, made.samples, self.noise, settings)
        answer = answered(recording, self.knowledge, settings, self.seed)
        judged = answer.verdict
        reason = SEPARATOR.join(label_of_test(test.name) for test in judged.tests if test.flagged)
        return scored(made, recording.model, answer.posterior, number, judged.status, reason)


def of_one_round(settings: HeartAnswersSettings) -> HeartAnswersSettings:
    """Return the same, whose chains end after one round; weights and chains that converge give the same.

    Chains of a heart that the model cannot be take minutes and do not converge. Where one round of them
    contradicts the model, they go no further.
    """
    exact = settings.exact
    mcmc = exact.mcmc.model_copy(update={"max_steps": exact.mcmc.steps})
    return settings.model_copy(update={"exact": exact.model_copy(update={"mcmc": mcmc})})


def levels_of(samples: Samples, settings: HeartAnswersSettings, repeats: Repeats) -> RepeatLevels:
    """Return the repeats of a recording, which tell its noise."""
    return levels_by(repeats, samples, rejection(samples, settings.recording) == ACCEPTED)


def recorded_as_answered(
    observation: Observation, samples: Samples, noise: NoiseComponents, settings: HeartAnswersSettings
) -> ModelledRecording:
    """Return a recorded heart under the model, with the test of its noise."""
    swept = settings.source.acquisition.sweep_fraction > 0.0
    levels = levels_of(samples, settings, "sweeps" if swept else "separate")
    test = noise_test(compare_noise(levels, noise), noise, "the cohort", settings.noise_level)
    speeds = measured_speeds(observation, noise)
    return ModelledRecording(observation, SpeedModel(speeds, settings.model), (test,))


def scored(
    made: RecordedHeart, model: SpeedModel, exact: ExactPosterior, number: int, verdict: str, reason: str
) -> HeartAnswer:
    """Return the intervals of a posterior beside the truths of the heart."""
    found = intervals(model, exact.phi, exact.interval_mass)
    return HeartAnswer(
        number, made.heart.context, made.redrawn, verdict, reason,
        by_mcmc=exact.by_mcmc, converged=exact.converged, efficiency=exact.efficiency,
        truth=truths(made.heart), **vars(found),
    )  # fmt: skip
