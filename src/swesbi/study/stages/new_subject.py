"""A subject outside the study, answered by a trained network: by that of the cohort, or of a population."""

from __future__ import annotations

import logging
import signal
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from pydantic import Field
from threadpoolctl import threadpool_limits

from swesbi.context import Context
from swesbi.heart.prior_simulations import read_simulations
from swesbi.measurement.clinical import with_pressures
from swesbi.measurement.likelihood import build_speed_model
from swesbi.measurement.settings import ClinicalSettings
from swesbi.measurement.speeds import SpeedRecording
from swesbi.networks.flow.files import load_flow
from swesbi.networks.flow.flow import FlowProposal, flow_proposal
from swesbi.population.settings import PopulationSettings
from swesbi.recording.noise import compare_noise, read_noise
from swesbi.recording.observation import read_observation
from swesbi.recording.protocol import Repeats, read_repeats
from swesbi.recording.reader import read_samples
from swesbi.recording.samples import ACCEPTED, Samples, rejection
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.recording.sweeps import levels_by
from swesbi.study.stages import subject_figures
from swesbi.study.stages.answers import Answer, AnswerSettings, Knowledge
from swesbi.study.stages.cmaes import CmaesStageSettings, cmaes
from swesbi.study.stages.cohort import IngestStageSettings, PassiveStageSettings, ingest, passive
from swesbi.study.stages.flow_training import TrainFlowStageSettings, TrainPopulationStageSettings
from swesbi.study.stages.origin import Origin
from swesbi.study.stages.other_network import check_network, check_quality
from swesbi.study.stages.pressures import PressuresStageSettings, infer_with_pressures
from swesbi.study.stages.sheet import OF_POPULATION, OF_STUDY, SheetSettings, save_sheet_of_samples
from swesbi.study.stages.simulation import SimulateSettings, simulate
from swesbi.verdict.context import check_context, check_declared, nearest_known
from swesbi.verdict.pooled import PooledNull, pool_subjects, read_null
from swesbi.verdict.recordings import NULL, read_subject_checks
from swesbi.verdict.settings import RuleSettings
from swesbi.verdict.verdict import VerdictTest

LOGGER = logging.getLogger("swesbi")
STREAM = "new subject"


class OneAnswerSettings(AnswerSettings):
    """Settings of all stages in turn, and of the tests that only a subject outside the study needs."""

    ingest: IngestStageSettings
    passive: PassiveStageSettings
    cmaes: CmaesStageSettings
    simulate: SimulateSettings
    exact_subject_figures: subject_figures.ExactSubjectFiguresSettings
    sheet: SheetSettings
    clinical: ClinicalSettings
    reference_recordings: int = Field(ge=100, description="prior predictive recordings of the subject")
    noise_level: float = Field(gt=0.0, lt=0.5, description="of the test that the noise is the pool's")


@dataclass(frozen=True)
class AnswerFiles:
    """What the study has of a subject, all of it output: artefacts, then figures.

    Attributes:
        observation: Observed curve.
        passive_baseline: Passive baseline of the reference fit; one file, or none where none is asked for.
        reference_fit: CMA-ES fit, likewise.
        shard: Simulations from the prior.
        posterior: Exact posterior.
        verdict: Verdict.
        predictive: Predictive check.
        ppc_png: Its figure.
        posterior_png: Figure of the posterior.
        sheet: One page of the subject.
        with_pressures: Exact posterior with the pressures of a cuff; one file, or none where none were taken.
    """

    observation: Path
    passive_baseline: Sequence[Path]
    reference_fit: Sequence[Path]
    shard: Path
    posterior: Path
    verdict: Path
    predictive: Path
    ppc_png: Path
    posterior_png: Path
    sheet: Path
    with_pressures: Sequence[Path]


def _answer(
    recording: Path,
    protocol: Path,
    noise: Path,
    files: AnswerFiles,
    knowledge: Knowledge,
    population: str,
    settings: OneAnswerSettings,
    origin: Origin,
) -> None:
    """Ingest the recording of ``origin.subject``, infer it, judge and draw it; errors as of the stages."""
    check_quality(noise, settings.ingest.recording)
    ingest(recording=recording, observation=files.observation, settings=settings.ingest, origin=origin)
    repeats, components = read_repeats(protocol, origin.subject), read_noise(noise).components
    known = known_noise(repeats, components)
    model = build_speed_model(files.observation, known, settings.exact_posterior.model)
    clinical = settings.ingest.clinical.to_measures()
    answer = Answer(model, knowledge, settings, origin, STREAM, clinical)
    # an answer is waited for: what does not need the posterior is made in a process of its own meanwhile
    with worker_process() as worker:
        reference = worker.submit(answer.reference, settings.reference_recordings)
        fitted = worker.submit(_fit, files, settings, origin)
        informed = [worker.submit(_with_pressures, answer, path, settings) for path in files.with_pressures]
        efficiency = answer.infer(files.posterior)
        quality = settings.ingest.recording
        samples = read_samples(
            recording, quality.phases, quality.density_kg_m3, settings.ingest.layout, origin.subject
        )
        noise_test = noise_test_of(samples, repeats, components, quality, settings.noise_level)
        judged = answer.judge(files.posterior, files.verdict, reference.result(), efficiency, [noise_test])
        LOGGER.info("subject %s: %s", origin.subject, judged.sentence)
        fitted.result()
        drawn = worker.submit(_draw_posterior, files, settings)
        simulations = read_simulations([files.shard])
        answer.check(files.observation, files.posterior, files.verdict, files.predictive, simulations)
        title = settings.exact_subject_figures.cohort_title
        subject_figures.save_predictive_check(
            files.predictive, files.verdict, files.reference_fit, files.ppc_png, title
        )
        drawn.result()
        for inferred in informed:
            inferred.result()
        save_sheet_of_samples(
            model=model,
            observation=files.observation,
            posterior=files.posterior,
            verdict=files.verdict,
            predictive=files.predictive,
            with_pressures=files.with_pressures,
            sheet=files.sheet,
            population=population,
            hearts=knowledge.contexts,
            clinical=clinical,
            settings=settings.sheet,
        )


def known_noise(repeats: Repeats, pooled: NoiseComponents) -> NoiseComponents:
    """Return the pool's components as the recording has them: of sweeps only where its repeats are such."""
    return pooled if repeats == "sweeps" else pooled.of_separate_repeats


def worker_process() -> ProcessPoolExecutor:
    """Return a process that shares what this one has in memory, made at its first task."""
    return ProcessPoolExecutor(1, mp_context=get_context("fork"), initializer=one_thread)


def one_thread() -> None:
    """Let libraries use one thread: those that their parent had started do not exist in a forked process.

    Of Ctrl-C only the parent speaks.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threadpool_limits(limits=1)


def _fit(files: AnswerFiles, settings: OneAnswerSettings, origin: Origin) -> None:
    """Simulate from the prior, and make the reference fit, if it is asked for."""
    simulate(shard=files.shard, settings=settings.simulate, origin=origin)
    for baseline, fit in zip(files.passive_baseline, files.reference_fit, strict=True):
        passive(observation=files.observation, passive=baseline, settings=settings.passive, origin=origin)
        cmaes(
            observation=files.observation, passive=baseline, cmaes=fit, settings=settings.cmaes, origin=origin
        )


def _with_pressures(answer: Answer, posterior: Path, settings: OneAnswerSettings) -> None:
    """Infer the subject from speeds and pressures.

    Raises:
        ValueError: None were taken.
    """
    model = with_pressures(answer.model, answer.clinical, settings.clinical)
    network = answer.knowledge.proposal(answer.model.recording)
    stage = PressuresStageSettings(exact_posterior=settings.exact_posterior, clinical=settings.clinical)
    infer_with_pressures(model, network, posterior, stage, answer.origin, STREAM)


def _draw_posterior(files: AnswerFiles, settings: OneAnswerSettings) -> None:
    subject_figures.save_exact_posterior(
        files.posterior, files.verdict, files.reference_fit, (), files.posterior_png,
        settings.exact_subject_figures,
    )  # fmt: skip


def noise_test_of(
    samples: Samples, repeats: Repeats, pooled: NoiseComponents, settings: RecordingSettings, level: float
) -> VerdictTest:
    """Test that a recording has the noise from which its standard errors are told.

    Args:
        samples: The raw recording.
        repeats: Whether its repeats are sweeps.
        pooled: That noise.
        settings: Quality control.
        level: Of the test.
    """
    levels = levels_by(repeats, samples, rejection(samples, settings) == ACCEPTED)
    comparison = compare_noise(levels, pooled)
    if np.isnan(comparison.p_value):
        why = "not tested: the recording alone does not tell its noise, and the cohort's is used"
        return VerdictTest("noise", 0.0, None, level, flagged=False, detail=why)
    return VerdictTest(
        name="noise",
        statistic=comparison.statistic,
        p_value=comparison.p_value,
        threshold=level,
        flagged=comparison.p_value <= level,
        detail=_noise_in_words(comparison.own, pooled),
    )


def _noise_in_words(own: NoiseComponents, pooled: NoiseComponents) -> str:
    words = (
        f"{own.repeat_fraction:.1%} between repeats and {own.sample_fraction:.1%} between samples; "
        "standard errors are estimated from the cohort's "
        f"{pooled.repeat_fraction:.1%} and {pooled.sample_fraction:.1%}"
    )
    if own.sweep_fraction or pooled.sweep_fraction:
        words += f"; {own.sweep_fraction:.1%} between sweeps, {pooled.sweep_fraction:.1%} in the cohort"
    return words


class NewSubjectStageSettings(OneAnswerSettings):
    """What an answer depends on, and how the network that gives it was trained."""

    train_flow: TrainFlowStageSettings
    margin_fraction: float = Field(ge=0.0, lt=1.0, description="accepted beyond the contexts trained on")


def new_subject(
    *,
    recording: Path,
    protocol: Path,
    estimator: Path,
    noise: Path,
    pooled_observations: Sequence[Path],
    misspecifications: Sequence[Path],
    files: AnswerFiles,
    settings: NewSubjectStageSettings,
    origin: Origin,
) -> None:
    """Ingest the recording of ``origin.subject``, infer it with the trained network, judge and draw it.

    Args:
        recording: The raw recording.
        protocol: ``recording.yaml`` of its cohort, which says whether its repeats are sweeps.
        estimator: The network.
        noise: Noise of the cohort that it was trained on.
        pooled_observations: Observed curves of that cohort, whose contexts it knows.
        misspecifications: Null distributions of that cohort.
        files: Output.

    Raises:
        ContextRefusedError: The network knows no such context.
        OtherNetworkError: The network was trained under other settings.
        RecordingError: The recording is malformed or too incomplete.
        ArtefactError: A file of the study is no such artefact.
        ValueError: A posterior with pressures is asked for, and none were taken.
    """
    trained = [read_observation(path).context for path in pooled_observations]
    check_context(settings.ingest.context.to_context(), trained, settings.margin_fraction)
    check_network(estimator, settings.train_flow)
    knowledge = Knowledge(
        proposal=partial(network_proposal, estimator, trained),
        contexts=trained,
        null=partial(_null_of_cohort, misspecifications, settings.verdict.rule),
    )
    _answer(recording, protocol, noise, files, knowledge, OF_STUDY, settings, origin)


def network_proposal(estimator: Path, trained: Sequence[Context], recording: SpeedRecording) -> FlowProposal:
    """Return the network's posterior; it is shown the nearest context that it knows, if it knows but some."""
    context = nearest_known(recording.context, trained) if trained else recording.context
    return flow_proposal(load_flow(estimator)[0], replace(recording, context=context))


def _null_of_cohort(misspecifications: Sequence[Path], rule: RuleSettings) -> PooledNull:
    return pool_subjects([read_subject_checks(path, (NULL,)) for path in misspecifications], rule)


class NewSubjectOfPopulationStageSettings(OneAnswerSettings):
    """What an answer depends on, how the network was trained, and for whom."""

    train_population: TrainPopulationStageSettings
    population: PopulationSettings


def new_subject_of_population(
    *,
    recording: Path,
    protocol: Path,
    estimator: Path,
    noise: Path,
    null: Path,
    files: AnswerFiles,
    settings: NewSubjectOfPopulationStageSettings,
    origin: Origin,
) -> None:
    """Ingest the recording of ``origin.subject``, infer it with a population's network, judge and draw it.

    Args:
        recording: The raw recording.
        protocol: ``recording.yaml`` of its cohort, which says whether its repeats are sweeps.
        estimator: The network.
        noise: Noise of the study's cohort, from which standard errors are told.
        null: Null recordings of the population.
        files: Output.

    Raises:
        ContextRefusedError: The context lies outside the declared range.
        OtherNetworkError: The network was trained under other settings.
        RecordingError: The recording is malformed or too incomplete.
        ArtefactError: A file of the study is no such artefact.
    """
    check_declared(settings.ingest.context.to_context(), settings.population)
    check_network(estimator, settings.train_population)
    knowledge = Knowledge(
        proposal=partial(network_proposal, estimator, ()),
        contexts=read_null(null).contexts,
        null=partial(_null_of_population, null),
    )
    _answer(recording, protocol, noise, files, knowledge, OF_POPULATION, settings, origin)


def _null_of_population(null: Path) -> PooledNull:
    return read_null(null).pooled
