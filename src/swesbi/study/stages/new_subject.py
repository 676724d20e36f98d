"""A subject outside the study, answered by a trained network: by that of the cohort, or of a population."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import torch
from pydantic import Field
from threadpoolctl import threadpool_limits

from swesbi.artefacts import write_json
from swesbi.base import Settings
from swesbi.context import Context
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import SpeedRecording
from swesbi.measurement.subjects import read_speed_model
from swesbi.networks.spline.files import load_spline, load_spline_provenance
from swesbi.population.settings import PopulationSettings
from swesbi.posterior.importance import FlowProposal, flow_proposal
from swesbi.posterior.refine import refined_posterior
from swesbi.posterior.settings import RefinementSettings
from swesbi.recording.components import repeat_levels
from swesbi.recording.noise import compare_noise, read_noise
from swesbi.recording.observation import read_observation
from swesbi.recording.reader import read_samples
from swesbi.recording.samples import ACCEPTED, rejection
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.study.inspect.read import flatten
from swesbi.study.stages.cmaes import CmaesStageSettings, cmaes
from swesbi.study.stages.cohort import IngestStageSettings, PassiveStageSettings, ingest, passive
from swesbi.study.stages.exact import ExactPosteriorStageSettings, write_posterior
from swesbi.study.stages.flow_training import TrainFlowStageSettings, TrainPopulationStageSettings
from swesbi.study.stages.origin import Origin
from swesbi.study.stages.predictive import PredictiveSpeedsStageSettings, predictive_speeds
from swesbi.study.stages.simulation import SimulateSettings, simulate
from swesbi.study.stages.subject_figures import (
    ExactSubjectFiguresSettings,
    save_exact_posterior,
    save_predictive_check,
)
from swesbi.study.stages.verdict import VerdictStageSettings, judge
from swesbi.verdict.context import check_context, check_declared, nearest_known
from swesbi.verdict.nulls import Reference
from swesbi.verdict.pooled import PooledNull, pool_subjects, pooled_reference, prior_predictive, read_null
from swesbi.verdict.recordings import NULL, read_subject_checks
from swesbi.verdict.support import SupportTest
from swesbi.verdict.verdict import network_test

LOGGER = logging.getLogger("swesbi")
STREAM = "new subject"


class AnswerSettings(Settings):
    """Settings of the stages in turn, and of the tests that only a subject outside the study needs."""

    ingest: IngestStageSettings
    passive: PassiveStageSettings
    cmaes: CmaesStageSettings
    simulate: SimulateSettings
    exact_posterior: ExactPosteriorStageSettings
    verdict: VerdictStageSettings
    predictive_speeds: PredictiveSpeedsStageSettings
    exact_subject_figures: ExactSubjectFiguresSettings
    reference_recordings: int = Field(ge=100, description="prior predictive recordings of the subject")
    refinement: RefinementSettings
    noise_level: float = Field(gt=0.0, lt=0.5, description="of the test that the noise is the pool's")


class OtherNetworkError(ValueError):
    """The network was trained under other settings than these."""


@dataclass(frozen=True)
class AnswerFiles:
    """What the study has of a subject, all of it output: artefacts, then figures."""

    observation: Path
    passive_baseline: Path
    reference_fit: Path
    shard: Path
    posterior: Path
    support: Path
    predictive: Path
    ppc_png: Path
    posterior_png: Path


@dataclass(frozen=True)
class Knowledge:
    """What answers the subject.

    Attributes:
        proposal: Loads the network and makes its posterior of a recording.
        others: Contexts with which the subject's is compared.
        reference: Makes the null distributions of the tests; runs in a process of its own.
    """

    proposal: Callable[[SpeedRecording], FlowProposal]
    others: Sequence[Context]
    reference: Callable[[SpeedModel], Reference]


def answer(
    recording: Path,
    noise: Path,
    files: AnswerFiles,
    knowledge: Knowledge,
    settings: AnswerSettings,
    origin: Origin,
) -> None:
    """Ingest the recording of ``origin.subject``, infer it, judge and draw it.

    Raises:
        RecordingError: The recording is malformed or too incomplete.
        ArtefactError: A file of the study is no such artefact.
    """
    ingest(recording=recording, observation=files.observation, settings=settings.ingest, origin=origin)
    model = read_speed_model(files.observation, noise, settings.exact_posterior.model)
    # an answer is waited for: what does not need the posterior is made beside it
    with process_beside() as beside:
        reference = beside.submit(knowledge.reference, model)
        fitted = beside.submit(_fit, files, settings, origin)
        network = knowledge.proposal(model.recording)
        sizes, stream = settings.exact_posterior.exact, (origin.seed, STREAM, origin.subject)
        exact, efficiency = refined_posterior(model, network, sizes, settings.refinement, *stream)
        write_posterior(files.posterior, exact, network, settings.exact_posterior, origin)
        tests = [
            _noise_test(
                recording, read_noise(noise).components, settings.ingest.recording, settings.noise_level
            ),
            network_test(efficiency, settings.refinement.min_efficiency),
        ]
        judged = judge(
            files.posterior, model, knowledge.others, reference.result(), settings.verdict, origin, tests
        )
        write_json(files.support, judged.to_json())
        LOGGER.info("subject %s: %s", origin.subject, judged.verdict)
        fitted.result()
        drawn = beside.submit(_draw_posterior, files, settings)
        _predict(noise, files, settings, origin)
        drawn.result()


def process_beside() -> ProcessPoolExecutor:
    """Return a process that shares what this one has in memory, made at its first task."""
    return ProcessPoolExecutor(1, mp_context=get_context("fork"), initializer=_one_thread)


def _one_thread() -> None:
    """Let libraries use one thread: those that their parent had started do not exist in a forked process.

    torch keeps a number of its own, and would wait for ever for them.
    """
    threadpool_limits(limits=1)
    torch.set_num_threads(1)


def _fit(files: AnswerFiles, settings: AnswerSettings, origin: Origin) -> None:
    """Simulate from the prior, and make the reference fit."""
    simulate(shard=files.shard, settings=settings.simulate, origin=origin)
    passive(
        observation=files.observation,
        passive=files.passive_baseline,
        settings=settings.passive,
        origin=origin,
    )
    cmaes(
        observation=files.observation, passive=files.passive_baseline, cmaes=files.reference_fit,
        settings=settings.cmaes, origin=origin,
    )  # fmt: skip


def _draw_posterior(files: AnswerFiles, settings: AnswerSettings) -> None:
    save_exact_posterior(
        files.posterior, files.support, files.reference_fit, (), files.posterior_png,
        settings.exact_subject_figures,
    )  # fmt: skip


def _predict(noise: Path, files: AnswerFiles, settings: AnswerSettings, origin: Origin) -> None:
    predictive_speeds(
        posterior=files.posterior, support=files.support, observation=files.observation, noise=noise,
        shards=[files.shard], predictive=files.predictive, settings=settings.predictive_speeds, origin=origin,
    )  # fmt: skip
    save_predictive_check(
        files.predictive, files.support, files.reference_fit, files.ppc_png,
        settings.exact_subject_figures.cohort_title,
    )  # fmt: skip


def check_network(estimator: Path, settings: Settings) -> None:
    """Refuse a network that was trained under other settings than those of the configuration.

    Raises:
        OtherNetworkError: Names the first setting that differs.
    """
    provenance = load_spline_provenance(estimator)
    here, there = flatten(settings.to_plain()), flatten(dict(provenance.settings))
    for key in sorted(here.keys() | there.keys()):
        if here.get(key) != there.get(key):
            raise OtherNetworkError(
                f"{estimator}: was trained with {key} = {there.get(key)}, the configuration has "
                f"{here.get(key)}; run the study again, or use the configuration that it was trained with"
            )


def _noise_test(
    recording: Path, pooled: NoiseComponents, settings: RecordingSettings, level: float
) -> SupportTest:
    """Test that the recording has the noise from which its standard errors are told."""
    samples = read_samples(recording, settings.phases, settings.density_kg_m3)
    found = compare_noise(repeat_levels(samples, rejection(samples, settings) == ACCEPTED), pooled)
    return SupportTest(
        name="noise",
        statistic=found.statistic,
        p_value=found.p_value,
        threshold=level,
        flagged=found.p_value <= level,
        detail=f"{found.own.repeat_fraction:.1%} between repeats and {found.own.sample_fraction:.1%} between "
        f"samples; standard errors are told from the cohort's {pooled.repeat_fraction:.1%} and "
        f"{pooled.sample_fraction:.1%}",
    )


class NewSubjectStageSettings(AnswerSettings):
    """What an answer depends on, and how the network that gives it was trained."""

    train_flow: TrainFlowStageSettings
    margin_fraction: float = Field(ge=0.0, lt=1.0, description="accepted beyond the contexts trained on")


def new_subject(
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
        proposal=partial(_proposal_of_cohort, estimator, trained),
        others=trained,
        reference=partial(
            _reference_of_cohort, misspecifications=misspecifications, settings=settings, origin=origin
        ),
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


def _proposal_of_cohort(
    estimator: Path, trained: Sequence[Context], recording: SpeedRecording
) -> FlowProposal:
    """Return the posterior of the network, which is shown the nearest context that it knows."""
    shown = replace(recording, context=nearest_known(recording.context, trained))
    return flow_proposal(load_spline(estimator)[0], shown)


def _reference_of_cohort(
    model: SpeedModel, misspecifications: Sequence[Path], settings: NewSubjectStageSettings, origin: Origin
) -> Reference:
    """Return the tests of the subject: its own prior predictive, the pool's null recordings."""
    rule, conditioning = settings.verdict.rule, settings.verdict.conditioning
    null = pool_subjects([read_subject_checks(path, (NULL,)) for path in misspecifications], rule)
    predictive = prior_predictive(model, conditioning, settings.reference_recordings, origin.seed, STREAM)
    return pooled_reference(null, predictive, rule)


class NewSubjectOfPopulationStageSettings(AnswerSettings):
    """What an answer depends on, how the network was trained, and for whom."""

    train_population: TrainPopulationStageSettings
    population: PopulationSettings


def new_subject_of_population(
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
        proposal=partial(_proposal_of_population, estimator),
        others=others.contexts,
        reference=partial(_reference_of_population, null=others.pooled, settings=settings, origin=origin),
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


def _proposal_of_population(estimator: Path, recording: SpeedRecording) -> FlowProposal:
    return flow_proposal(load_spline(estimator)[0], recording)


def _reference_of_population(
    model: SpeedModel, null: PooledNull, settings: NewSubjectOfPopulationStageSettings, origin: Origin
) -> Reference:
    """Return the tests of the subject: its own prior predictive, the population's null recordings."""
    rule, count = settings.verdict.rule, settings.reference_recordings
    predictive = prior_predictive(model, settings.verdict.conditioning, count, origin.seed, STREAM)
    return pooled_reference(null, predictive, rule)
