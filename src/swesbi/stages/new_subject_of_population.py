"""Stage: a subject outside the study, answered by the network of a population."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from swesbi.exact.proposal import FlowProposal, flow_proposal
from swesbi.flow.files import load_flow
from swesbi.misspecification.pooled import PooledNull, pooled_reference, prior_predictive
from swesbi.misspecification.reference import Reference
from swesbi.new_subject.context_range import check_declared
from swesbi.population.null_dataset import read_null
from swesbi.population.settings import PopulationSettings
from swesbi.speed_model.model import SpeedModel
from swesbi.speed_model.recording import SpeedRecording
from swesbi.stages import train_population
from swesbi.stages.new_subject_chain import (
    STREAM,
    AnswerFiles,
    AnswerSettings,
    Knowledge,
    answer,
    check_network,
)
from swesbi.stages.origin import Origin


class NewSubjectOfPopulationStageSettings(AnswerSettings):
    """What an answer depends on, how the network was trained, and for whom."""

    train_population: train_population.TrainPopulationStageSettings
    population: PopulationSettings


def run(
    *,
    recording: Path,
    estimator: Path,
    noise: Path,
    null: Path,
    observation: Path,
    passive_baseline: Path,
    reference_fit: Path,
    shard: Path,
    posterior: Path,
    support: Path,
    predictive: Path,
    ppc_png: Path,
    posterior_png: Path,
    settings: NewSubjectOfPopulationStageSettings,
    origin: Origin,
) -> None:
    """Ingest the recording of ``origin.subject``, infer it with the population's network, judge and draw it.

    Args:
        recording: The raw recording.
        estimator: The network.
        noise: Noise of the study's cohort, from which standard errors are told.
        null: Null recordings of the population.
        observation: Output, as are the following: what the study has of a subject.
        passive_baseline: Passive baseline of the reference fit.
        reference_fit: CMA-ES fit.
        shard: Simulations from the prior.
        posterior: Exact posterior.
        support: Verdict.
        predictive: Predictive check.
        ppc_png: Its figure.
        posterior_png: Figure of the posterior.
        settings: Settings of each stage.
        origin: Subject, seed and code.

    Raises:
        ContextRefusedError: The context lies outside the declared range.
        OtherNetworkError: The network was trained under other settings.
        RecordingError: The recording is malformed or too incomplete.
        ArtefactError: A file of the study is no such artefact.
    """
    check_declared(settings.ingest.context.to_context(), settings.population)
    check_network(estimator, settings.train_population)
    others = read_null(null)
    knowledge = Knowledge(
        proposal=partial(_proposal, estimator),
        others=others.contexts,
        reference=partial(_reference, null=others.pooled, settings=settings, origin=origin),
    )
    files = AnswerFiles(
        observation,
        passive_baseline,
        reference_fit,
        shard,
        posterior,
        support,
        predictive,
        ppc_png,
        posterior_png,
    )
    answer(recording, noise, files, knowledge, settings, origin)


def _proposal(estimator: Path, recording: SpeedRecording) -> FlowProposal:
    return flow_proposal(load_flow(estimator)[0], recording)


def _reference(
    model: SpeedModel, null: PooledNull, settings: NewSubjectOfPopulationStageSettings, origin: Origin
) -> Reference:
    """Return the tests of the subject: its own prior predictive, the population's null recordings."""
    rule, count = settings.verdict.rule, settings.reference_recordings
    predictive = prior_predictive(model, settings.verdict.conditioning, count, origin.seed, STREAM)
    return pooled_reference(null, predictive, rule)
