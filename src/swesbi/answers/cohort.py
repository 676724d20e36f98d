"""Answers of a population's network for the subjects of the cohort, on speeds and with pressures."""

from __future__ import annotations

from typing import Final, NamedTuple

from swesbi.answers.answer import AnyCheck, answered, check_answer, informed
from swesbi.answers.knowledge import Knowledge
from swesbi.answers.recording import ModelledRecording
from swesbi.answers.settings import AnswerSettings
from swesbi.checks.settings import PredictiveSettings
from swesbi.measurement.clinical import with_pressures
from swesbi.measurement.likelihood import SpeedModelSettings, speed_model
from swesbi.measurement.settings import SummarySettings
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.settings import ExactSettings
from swesbi.recording.cohort.clinical import ClinicalErrors
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.verdict.null_recordings import NullRecordings
from swesbi.verdict.settings import EjectionTimeSettings, RuleSettings, UninformativeSettings
from swesbi.verdict.verdict import Verdict

STREAM: Final = "population answer"


class AnswerOfPopulation(NamedTuple):
    """What the network of a population says of a subject."""

    posterior: ExactPosterior
    verdict: Verdict
    predictive: AnyCheck


def answer_of_population(
    observation: Observation,
    noise: CohortNoise,
    estimator: TrainedFlow,
    null: NullRecordings,
    *,
    model: SpeedModelSettings,
    exact: ExactSettings,
    summary: SummarySettings,
    predictive: PredictiveSettings,
    rule: RuleSettings,
    ejection_time: EjectionTimeSettings,
    lvet_sd_ms: float,
    uninformative: UninformativeSettings,
    seed: int,
) -> AnswerOfPopulation:
    """Answer a subject of the cohort."""
    settings = AnswerSettings(
        model=model,
        exact=exact,
        summary=summary,
        predictive=predictive,
        rule=rule,
        ejection_time=ejection_time,
        lvet_sd_ms=lvet_sd_ms,
        uninformative=uninformative,
    )
    recording = ModelledRecording(observation, speed_model(observation, noise, model), stream=STREAM)
    answer = answered(recording, Knowledge(null, estimator), settings, seed)
    return AnswerOfPopulation(answer.posterior, answer.verdict, check_answer(answer, settings, seed))


def answer_with_pressures(
    observation: Observation,
    noise: CohortNoise,
    of_speeds: ExactPosterior,
    *,
    model: SpeedModelSettings,
    exact: ExactSettings,
    clinical: ClinicalErrors,
    seed: int,
) -> ExactPosterior:
    """Infer a subject from speeds and cuff pressures, from its posterior of the speeds on."""
    both = with_pressures(speed_model(observation, noise, model), observation.clinical, clinical)
    return informed(both, of_speeds.weighted, exact, seed, "pressures", "pressures", observation.subject)
