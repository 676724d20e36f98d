"""Stage: a subject outside the pool, answered by the trained network as it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from pydantic import Field

from swesbi.context import Context
from swesbi.exact.proposal import FlowProposal, flow_proposal
from swesbi.flow.files import load_flow
from swesbi.misspecification.dataset import NULL, read_subject_checks
from swesbi.misspecification.pooled import pool_subjects, pooled_reference, prior_predictive
from swesbi.misspecification.reference import Reference
from swesbi.new_subject.context_range import check_context, nearest_known
from swesbi.recording.dataset import read_observation
from swesbi.speed_model.model import SpeedModel
from swesbi.speed_model.recording import SpeedRecording
from swesbi.stages import train_flow
from swesbi.stages.new_subject_chain import (
    STREAM,
    AnswerFiles,
    AnswerSettings,
    Knowledge,
    answer,
    check_network,
)
from swesbi.stages.origin import Origin


class NewSubjectStageSettings(AnswerSettings):
    """What an answer depends on, and how the network that gives it was trained."""

    train_flow: train_flow.TrainFlowStageSettings
    margin_fraction: float = Field(ge=0.0, lt=1.0, description="accepted beyond the contexts trained on")


def run(
    *,
    recording: Path,
    estimator: Path,
    noise: Path,
    pooled_observations: Sequence[Path],
    misspecifications: Sequence[Path],
    observation: Path,
    passive_baseline: Path,
    reference_fit: Path,
    shard: Path,
    posterior: Path,
    support: Path,
    predictive: Path,
    ppc_png: Path,
    posterior_png: Path,
    settings: NewSubjectStageSettings,
    origin: Origin,
) -> None:
    """Ingest the recording of ``origin.subject``, infer it with the trained network, judge and draw it.

    Args:
        recording: The raw recording.
        estimator: The network.
        noise: Noise of the cohort that it was trained on.
        pooled_observations: Observed curves of that cohort, whose contexts it knows.
        misspecifications: Null distributions of that cohort.
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
        ContextRefusedError: The network knows no such context.
        OtherNetworkError: The network was trained under other settings.
        RecordingError: The recording is malformed or too incomplete.
        ArtefactError: A file of the study is no such artefact.
    """
    trained = [read_observation(path).context for path in pooled_observations]
    check_context(settings.ingest.context.to_context(), trained, settings.margin_fraction)
    check_network(estimator, settings.train_flow)
    knowledge = Knowledge(
        proposal=partial(_proposal, estimator, trained),
        others=trained,
        reference=partial(_reference, misspecifications=misspecifications, settings=settings, origin=origin),
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


def _proposal(estimator: Path, trained: Sequence[Context], recording: SpeedRecording) -> FlowProposal:
    """Return the posterior of the network, which is shown the nearest context that it knows."""
    shown = replace(recording, context=nearest_known(recording.context, trained))
    return flow_proposal(load_flow(estimator)[0], shown)


def _reference(
    model: SpeedModel, misspecifications: Sequence[Path], settings: NewSubjectStageSettings, origin: Origin
) -> Reference:
    """Return the tests of the subject: its own prior predictive, the pool's null recordings."""
    rule, conditioning = settings.verdict.rule, settings.verdict.conditioning
    null = pool_subjects([read_subject_checks(path, (NULL,)) for path in misspecifications], rule)
    predictive = prior_predictive(model, conditioning, settings.reference_recordings, origin.seed, STREAM)
    return pooled_reference(null, predictive, rule)
