"""The chain of stages that answers one subject with a trained network, and everything that is shown of it."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import torch
from pydantic import Field
from threadpoolctl import threadpool_limits

from swesbi.artefacts import write_json
from swesbi.context import Context
from swesbi.exact.proposal import FlowProposal
from swesbi.exact.refinement import refined_posterior
from swesbi.exact.settings import RefinementSettings
from swesbi.flow.files import load_flow_provenance
from swesbi.inference.support import SupportTest
from swesbi.inspection.content import flatten
from swesbi.misspecification.network import network_test
from swesbi.misspecification.reference import Reference
from swesbi.noise.dataset import read_noise
from swesbi.noise.levels import repeat_levels
from swesbi.noise.single import compare_noise
from swesbi.recording.quality import ACCEPTED, rejection
from swesbi.recording.reader import read_samples
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.settings import Settings
from swesbi.speed_model.model import SpeedModel
from swesbi.speed_model.recording import SpeedRecording
from swesbi.speed_model.subjects import read_speed_model
from swesbi.stages import (
    cmaes,
    exact_posterior,
    exact_subject_figures,
    ingest,
    passive,
    predictive_speeds,
    simulate,
    verdict,
)
from swesbi.stages.origin import Origin
from swesbi.stages.subject_figures import save_predictive_check

LOGGER = logging.getLogger("swesbi")
STREAM = "new subject"


class AnswerSettings(Settings):
    """Settings of the stages in turn, and of the tests that only a subject outside the study needs."""

    ingest: ingest.IngestStageSettings
    passive: passive.PassiveStageSettings
    cmaes: cmaes.CmaesStageSettings
    simulate: simulate.SimulateSettings
    exact_posterior: exact_posterior.ExactPosteriorStageSettings
    verdict: verdict.VerdictStageSettings
    predictive_speeds: predictive_speeds.PredictiveSpeedsStageSettings
    exact_subject_figures: exact_subject_figures.ExactSubjectFiguresSettings
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
    ingest.run(recording=recording, observation=files.observation, settings=settings.ingest, origin=origin)
    model = read_speed_model(files.observation, noise, settings.exact_posterior.model)
    # an answer is waited for: what does not need the posterior is made beside it
    with process_beside() as beside:
        reference = beside.submit(knowledge.reference, model)
        fitted = beside.submit(_fit, files, settings, origin)
        network = knowledge.proposal(model.recording)
        sizes, stream = settings.exact_posterior.exact, (origin.seed, STREAM, origin.subject)
        exact, efficiency = refined_posterior(model, network, sizes, settings.refinement, *stream)
        exact_posterior.write_posterior(files.posterior, exact, network, settings.exact_posterior, origin)
        tests = [
            _noise_test(
                recording, read_noise(noise).components, settings.ingest.recording, settings.noise_level
            ),
            network_test(efficiency, settings.refinement.min_efficiency),
        ]
        judged = verdict.judge(
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
    simulate.run(shard=files.shard, settings=settings.simulate, origin=origin)
    passive.run(
        observation=files.observation,
        passive=files.passive_baseline,
        settings=settings.passive,
        origin=origin,
    )
    cmaes.run(
        observation=files.observation, passive=files.passive_baseline, cmaes=files.reference_fit,
        settings=settings.cmaes, origin=origin,
    )  # fmt: skip


def _draw_posterior(files: AnswerFiles, settings: AnswerSettings) -> None:
    exact_subject_figures.save_exact_posterior(
        files.posterior, files.support, files.reference_fit, (), files.posterior_png,
        settings.exact_subject_figures,
    )  # fmt: skip


def _predict(noise: Path, files: AnswerFiles, settings: AnswerSettings, origin: Origin) -> None:
    predictive_speeds.run(
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
    provenance = load_flow_provenance(estimator)
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
