"""Answers of a population's network for the subjects of the cohort: posterior, verdict, predictive check."""

from __future__ import annotations

from pathlib import Path

from swesbi.answers.answer import answered, shown_of
from swesbi.answers.knowledge import knowledge_of_population
from swesbi.answers.recording import ModelledRecording
from swesbi.answers.settings import AnswerSettings
from swesbi.artefacts import Origin, save, write_json
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import measured_speeds
from swesbi.posterior.result import exact_to_groups
from swesbi.posterior.truncated import POSTERIOR
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation

STREAM = "population answer"


def population_answers(
    *,
    observation: Path,
    noise: Path,
    estimator: Path,
    null: Path,
    posterior: Path,
    verdict: Path,
    predictive: Path,
    settings: AnswerSettings,
    origin: Origin,
) -> None:
    """Write posterior, verdict and predictive check of a subject.

    Args:
        observation: Observed curve.
        noise: Noise of the cohort.
        estimator: The network.
        null: Null recordings of the population.
        posterior: Output.
        verdict: Output.
        predictive: Output.

    Raises:
        ArtefactError: An input is no such artefact.
        NoLikelihoodError: Every simulation fails.
        ValueError: Every posterior draw failed in the simulator.
    """
    observed = Observation.read(observation)
    stage = settings.exact_posterior
    model = SpeedModel(measured_speeds(observed, CohortNoise.read(noise).of(observed.subject)), stage.model)
    recording = ModelledRecording(observed, model, stream=STREAM)
    knowledge = knowledge_of_population(estimator, null)
    answer = answered(recording, knowledge, settings, origin.seed)
    groups = exact_to_groups(answer.posterior, stage.model.prior)
    save(posterior, groups, origin.provenance(POSTERIOR, stage))
    write_json(verdict, answer.verdict.to_json())
    kept = shown_of(answer, settings, origin.seed).kept
    save(predictive, kept.groups, origin.provenance(kept.kind, settings.predictive_speeds))
