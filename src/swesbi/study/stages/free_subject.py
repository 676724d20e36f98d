"""A subject outside the study whose recording is free-running, answered by a network or without."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pydantic import Field

from swesbi.artefacts import save, to_groups, write_json
from swesbi.base.arrays import FloatArray
from swesbi.base.settings import Level, Settings
from swesbi.checks.free_predictive import KIND as PREDICTIVE
from swesbi.checks.free_predictive import FreePredictiveCheck, check_pushes
from swesbi.heart.periodic import Status
from swesbi.measurement.derived import told
from swesbi.measurement.instants import FreeModel, free_model
from swesbi.networks.flow.files import load_flow
from swesbi.networks.flow.flow import FlowProposal, free_proposal
from swesbi.population.settings import PopulationSettings
from swesbi.posterior.exact import ExactPosterior, exact_posterior
from swesbi.posterior.result import ExactResult, read_exact_result
from swesbi.prior import draw_prior
from swesbi.recording.free_noise import SOURCES
from swesbi.recording.free_observation import KIND, FreeObservation, ingest_free
from swesbi.recording.free_samples import read_free_samples
from swesbi.recording.settings import NoiseDeclaration
from swesbi.report.figures.free_predictive import draw_free_check
from swesbi.report.figures.predictive import NETWORK_ALONE
from swesbi.report.figures.style import save_figure
from swesbi.seeds import generator
from swesbi.study.stages.cohort import IngestStageSettings
from swesbi.study.stages.exact import ExactPosteriorStageSettings, write_posterior
from swesbi.study.stages.flow_training import TrainPopulationStageSettings
from swesbi.study.stages.origin import Origin
from swesbi.study.stages.other_network import check_network
from swesbi.study.stages.sheet import OF_POPULATION, OF_PRIOR, SheetSettings, save_sheet_of_pushes
from swesbi.study.stages.subject_figures import ExactSubjectFiguresSettings, save_exact_posterior
from swesbi.study.stages.verdict import VerdictStageSettings
from swesbi.verdict.context import check_declared
from swesbi.verdict.contraction import contractions
from swesbi.verdict.ejection import ejection_tests
from swesbi.verdict.settings import UninformativeSettings
from swesbi.verdict.verdict import Verdict
from swesbi.verdict.volumes import volume_tests
from swesbi.verdict.without_null import residual_test, verdict_without_null

LOGGER = logging.getLogger("swesbi")
STREAM = "free subject"
PRIOR_DRAWS = "prior, from which it began"


class FreeSubjectStageSettings(Settings):
    """What the answer to a free-running recording depends on."""

    ingest: IngestStageSettings
    noise: NoiseDeclaration
    exact_posterior: ExactPosteriorStageSettings
    verdict: VerdictStageSettings
    exact_subject_figures: ExactSubjectFiguresSettings
    sheet: SheetSettings
    predictive_draws: int = Field(ge=1, description="posterior draws of the predictive check")
    predictive_interval: Level = Field(description="mass of its intervals")
    uninformative: UninformativeSettings


@dataclass(frozen=True)
class FreeFiles:
    """What is written of a free-running recording.

    Attributes:
        observation: Its pushes.
        posterior: Exact posterior.
        verdict: Verdict, or that there is none.
        posterior_png: Figure of the posterior.
        predictive: Predictive check.
        ppc_png: Its figure.
        sheet: One page of the subject.
    """

    observation: Path
    posterior: Path
    verdict: Path
    posterior_png: Path
    predictive: Path
    ppc_png: Path
    sheet: Path


Infer = Callable[[FreeModel], tuple[ExactPosterior, FlowProposal | None]]
"""Draws from the exact posterior of a recording, beginning with a network's if there is one."""


def free_subject(
    *, recording: Path, files: FreeFiles, settings: FreeSubjectStageSettings, origin: Origin
) -> None:
    """Ingest the free-running recording of ``origin.subject``, infer it from the prior on, judge and draw it.

    Raises:
        RecordingError: The recording is malformed, has too few pushes, or nothing tells its errors.
        NoLikelihoodError: Every simulation fails.
        ArtefactError: A file cannot be written.
    """

    def infer(model: FreeModel) -> tuple[ExactPosterior, None]:
        exact = settings.exact_posterior.exact
        return exact_posterior(model, None, exact, origin.seed, STREAM, origin.subject)[0], None

    _answer(recording, infer, files, settings, origin)


class FreeSubjectOfPopulationStageSettings(FreeSubjectStageSettings):
    """What such an answer depends on, how the network was trained, and for whom."""

    train_population: TrainPopulationStageSettings
    population: PopulationSettings


def free_subject_of_population(
    *,
    recording: Path,
    estimator: Path,
    files: FreeFiles,
    settings: FreeSubjectOfPopulationStageSettings,
    origin: Origin,
) -> None:
    """Ingest the free-running recording of ``origin.subject``, and answer it by the network of a population.

    Raises:
        ContextRefusedError: The context lies outside the declared range.
        OtherNetworkError: The network was trained under other settings.
        RecordingError: The recording is malformed, has too few pushes, or nothing tells its errors.
        ArtefactError: A file cannot be read or written.
    """
    check_declared(settings.ingest.context.to_context(), settings.population)
    check_network(estimator, settings.train_population)
    flow, _ = load_flow(estimator)

    def infer(model: FreeModel) -> tuple[ExactPosterior, FlowProposal]:
        exact, network = settings.exact_posterior.exact, free_proposal(flow, model)
        return exact_posterior(model, network, exact, origin.seed, STREAM, origin.subject)[0], network

    _answer(recording, infer, files, settings, origin)


def _answer(
    recording: Path,
    infer: Infer,
    files: FreeFiles,
    settings: FreeSubjectStageSettings,
    origin: Origin,
) -> None:
    observed = _observed(recording, settings)
    save(files.observation, to_groups(observed), origin.provenance(KIND, settings))
    model = free_model(observed, settings.exact_posterior.model)
    exact, network = infer(model)
    write_posterior(files.posterior, exact, network, settings.exact_posterior, origin)
    result = read_exact_result(files.posterior)
    # drawn, since what the posterior began with may be a network's
    prior = draw_prior(
        model.settings.prior,
        settings.predictive_draws,
        generator(origin.seed, STREAM, origin.subject, "prior curves"),
    )
    judged = _judged(model, result, prior, observed, settings, origin)
    write_json(files.verdict, judged.to_json())
    check = _checked(model, result, prior, settings, origin)
    save(files.predictive, to_groups(check), origin.provenance(PREDICTIVE, settings))
    LOGGER.info("subject %s: %s", origin.subject, judged.sentence)
    start = PRIOR_DRAWS if network is None else NETWORK_ALONE
    save_exact_posterior(
        files.posterior, files.verdict, (), (), files.posterior_png, settings.exact_subject_figures, start
    )
    title, errors = settings.exact_subject_figures.cohort_title, SOURCES[observed.noise_source]
    save_figure(draw_free_check(origin.subject, check, judged, errors, title), files.ppc_png)
    save_sheet_of_pushes(
        model=model,
        observation=files.observation,
        posterior=files.posterior,
        verdict=files.verdict,
        predictive=files.predictive,
        sheet=files.sheet,
        population=OF_PRIOR if network is None else OF_POPULATION,
        settings=settings.sheet,
    )


def _observed(recording: Path, settings: FreeSubjectStageSettings) -> FreeObservation:
    ingestion = settings.ingest
    quality, context = ingestion.recording, ingestion.context.to_context()
    samples = read_free_samples(recording, quality.density_kg_m3, ingestion.layout, context.subject)
    return ingest_free(samples, context, quality, settings.noise, ingestion.clinical.to_measures())


def _checked(
    model: FreeModel,
    exact: ExactResult,
    prior: FloatArray,
    settings: FreeSubjectStageSettings,
    origin: Origin,
) -> FreePredictiveCheck:
    measurement = settings.exact_posterior.model.measurement
    rng = generator(origin.seed, STREAM, origin.subject, "new pushes")
    return check_pushes(
        model,
        exact.phi[: settings.predictive_draws],
        prior,
        settings.predictive_interval,
        measurement.grid_points,
        rng,
    )


def _judged(
    model: FreeModel,
    exact: ExactResult,
    prior: FloatArray,
    observed: FreeObservation,
    settings: FreeSubjectStageSettings,
    origin: Origin,
) -> Verdict:
    """Return what can be said without null distributions."""
    plain, judging = model.model, settings.verdict
    rule = judging.rule
    beats = plain.simulate(exact.phi)
    works = beats.status == Status.PERIODIC
    predicted = model.predict_from(exact.phi, beats).rows(works.nonzero()[0])
    rng = generator(origin.seed, STREAM, origin.subject, "residuals")
    period_s, sd_ms = observed.context.period_s, judging.lvet_sd_ms
    ejection = ejection_tests(beats, period_s, observed.clinical, sd_ms, judging.ejection_time)
    volumes = volume_tests(plain, exact.phi, beats, rule.volumes)
    residuals = residual_test(model, predicted, rule, rng)
    answer = told(plain, exact.phi, beats)
    before = told(plain, prior, plain.simulate(prior))
    contracted = contractions(answer, before, settings.uninformative)
    return verdict_without_null(
        model, exact, predicted, residuals, volumes, ejection, contracted, answer, rule
    )
