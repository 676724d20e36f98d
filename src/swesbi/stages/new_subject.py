"""Stage: a subject outside the pool, answered by the trained network as it is."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

from pydantic import Field

from swesbi.artefacts import write_json
from swesbi.context import Context
from swesbi.exact.proposal import flow_proposal
from swesbi.exact.refinement import refined_posterior
from swesbi.exact.settings import RefinementSettings
from swesbi.flow.files import load_flow
from swesbi.inference.support import SupportTest
from swesbi.inspection.content import flatten
from swesbi.misspecification.dataset import NULL, read_subject_checks
from swesbi.misspecification.network import network_test
from swesbi.misspecification.pooled import pool_subjects, pooled_reference, prior_predictive
from swesbi.misspecification.reference import Reference
from swesbi.new_subject.context_range import check_context, nearest_known
from swesbi.noise import repeat_levels
from swesbi.noise.dataset import read_noise
from swesbi.noise.single import compare_noise
from swesbi.recording import RecordingSettings, read_samples
from swesbi.recording.dataset import read_observation
from swesbi.recording.quality import ACCEPTED, rejection
from swesbi.recording.speed import NoiseComponents
from swesbi.settings import Settings
from swesbi.speed_model.model import SpeedModel
from swesbi.speed_model.subjects import read_speed_model
from swesbi.stages import (
    cmaes,
    exact_figure,
    exact_posterior,
    ingest,
    passive,
    ppc_figure,
    predictive_speeds,
    simulate,
    train_flow,
    verdict,
)
from swesbi.stages.origin import Origin

LOGGER = logging.getLogger("swesbi")
STREAM = "new subject"


class NewSubjectStageSettings(Settings):
    """Settings of the stages in turn, and what only a subject outside the pool needs."""

    ingest: ingest.IngestStageSettings
    passive: passive.PassiveStageSettings
    cmaes: cmaes.CmaesStageSettings
    simulate: simulate.SimulateSettings
    train_flow: train_flow.TrainFlowStageSettings
    exact_posterior: exact_posterior.ExactPosteriorStageSettings
    verdict: verdict.VerdictStageSettings
    predictive_speeds: predictive_speeds.PredictiveSpeedsStageSettings
    exact_figure: exact_figure.ExactFigureSettings
    reference_recordings: int = Field(ge=100, description="prior predictive recordings of the subject")
    refinement: RefinementSettings
    margin_fraction: float = Field(ge=0.0, lt=1.0, description="accepted beyond the contexts trained on")
    noise_level: float = Field(gt=0.0, lt=0.5, description="of the test that the noise is the pool's")


class OtherNetworkError(ValueError):
    """The network was trained under other settings than these."""


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
    _check_network(estimator, settings.train_flow)
    ingest.run(recording=recording, observation=observation, settings=settings.ingest, origin=origin)
    model = read_speed_model(observation, noise, settings.exact_posterior.model)
    # an answer is waited for: what does not need the posterior is made beside it
    with ProcessPoolExecutor(1, mp_context=get_context("fork")) as beside:
        reference = beside.submit(_reference, model, misspecifications, settings, origin)
        fitted = beside.submit(_fit, observation, passive_baseline, reference_fit, shard, settings, origin)
        efficiency = _infer(model, estimator, trained, posterior, settings, origin)
        noise_test = _noise_test(
            recording, read_noise(noise).components, settings.ingest.recording, settings.noise_level
        )
        further = [noise_test, network_test(efficiency, settings.refinement.min_efficiency)]
        judged = verdict.judge(
            posterior, model, trained, reference.result(), settings.verdict, origin, further
        )
        write_json(support, judged.to_json())
        LOGGER.info("subject %s: %s", origin.subject, judged.verdict)
        fitted.result()
        shown = (posterior, support, reference_fit, posterior_png)
        drawn = beside.submit(_draw_posterior, *shown, settings, origin)
        predictive_speeds.run(
            posterior=posterior, support=support, observation=observation, noise=noise, shards=[shard],
            predictive=predictive, settings=settings.predictive_speeds, origin=origin,
        )  # fmt: skip
        title = ppc_figure.PpcFigureSettings(cohort_title=settings.exact_figure.cohort_title)
        ppc_figure.run(
            predictive=predictive, support=support, cmaes=reference_fit, figure=ppc_png,
            settings=title, origin=origin,
        )  # fmt: skip
        drawn.result()


def _fit(
    observation: Path,
    passive_baseline: Path,
    reference_fit: Path,
    shard: Path,
    settings: NewSubjectStageSettings,
    origin: Origin,
) -> None:
    """Simulate from the prior, and make the reference fit."""
    simulate.run(shard=shard, settings=settings.simulate, origin=origin)
    passive.run(observation=observation, passive=passive_baseline, settings=settings.passive, origin=origin)
    cmaes.run(
        observation=observation, passive=passive_baseline, cmaes=reference_fit,
        settings=settings.cmaes, origin=origin,
    )  # fmt: skip


def _draw_posterior(
    posterior: Path,
    support: Path,
    reference_fit: Path,
    figure: Path,
    settings: NewSubjectStageSettings,
    origin: Origin,
) -> None:
    exact_figure.run(
        posterior=posterior, support=support, cmaes=reference_fit, truth=(), figure=figure,
        settings=settings.exact_figure, origin=origin,
    )  # fmt: skip


def _infer(
    model: SpeedModel,
    estimator: Path,
    trained: Sequence[Context],
    posterior: Path,
    settings: NewSubjectStageSettings,
    origin: Origin,
) -> tuple[float, ...]:
    """Write the exact posterior; return the efficiency of the network's draws and of each refinement."""
    shown = replace(model.recording, context=nearest_known(model.recording.context, trained))
    network = flow_proposal(load_flow(estimator)[0], shown)
    sizes, refinement = settings.exact_posterior.exact, settings.refinement
    stream = (origin.seed, STREAM, origin.subject)
    exact, efficiency = refined_posterior(model, network, sizes, refinement, *stream)
    exact_posterior.write_posterior(posterior, exact, network, settings.exact_posterior, origin)
    return efficiency


def _check_network(estimator: Path, settings: train_flow.TrainFlowStageSettings) -> None:
    """Refuse a network that was trained under other settings than those of the configuration.

    Raises:
        OtherNetworkError: Names the first setting that differs.
    """
    _, provenance = load_flow(estimator)
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


def _reference(
    model: SpeedModel, misspecifications: Sequence[Path], settings: NewSubjectStageSettings, origin: Origin
) -> Reference:
    """Return the tests of the subject: its own prior predictive, the pool's null recordings."""
    rule, conditioning = settings.verdict.rule, settings.verdict.conditioning
    null = pool_subjects([read_subject_checks(path, (NULL,)) for path in misspecifications], rule)
    predictive = prior_predictive(model, conditioning, settings.reference_recordings, origin.seed, STREAM)
    return pooled_reference(null, predictive, rule)
