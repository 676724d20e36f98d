"""The virtual volunteers recorded anew under other seeds, each recording judged by a trained network."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from studies.acquisition_seeds.settings import Seeds
from studies.acquisition_seeds.table import SeedRow, seeds_table
from studies.acquisition_seeds.truth import truth_of
from swesbi.base.arrays import FloatArray
from swesbi.base.progress import Progress
from swesbi.base.settings import Settings
from swesbi.checks.draws import CurveScores, score_cycles, score_theta
from swesbi.checks.scores import reduction_percent
from swesbi.checks.settings import PredictiveSettings
from swesbi.heart.prior_simulations import PriorSimulations, group_by_subject, read_simulations
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import Beats
from swesbi.measurement import likelihood
from swesbi.measurement.operator import PassiveCalibrationError, calibrate_passive
from swesbi.measurement.settings import MeasurementSettings, PassiveSettings, SummarySettings
from swesbi.networks.paper.maf import Sampler, draw_until
from swesbi.networks.paper.pool import Pool, with_context
from swesbi.population.synthetic import features_under
from swesbi.prior import PriorSettings, in_bounds
from swesbi.recording.acquisition_settings import ACQUISITION_SEED
from swesbi.recording.ingest import ingest
from swesbi.recording.problems import RecordingError
from swesbi.recording.settings import RecordingSettings
from swesbi.seeds import integer_seed
from swesbi.verdict.prior_support import diagnose
from swesbi.verdict.settings import SupportSettings
from swesbi.verdict.verdict import Verdict
from swesbi.virtual.volunteers import Truth, record

LOGGER = logging.getLogger("swesbi")


class AcquisitionSeedsStageSettings(Settings):
    """What the study over acquisition seeds depends on."""

    seeds: Seeds
    prior: PriorSettings
    passive_reference_prior: PriorSettings
    forward_model: ForwardModelSettings
    recording: RecordingSettings
    measurement: MeasurementSettings
    passive: PassiveSettings
    summary: SummarySettings
    support: SupportSettings
    predictive: PredictiveSettings


@dataclass(frozen=True)
class _Judge:
    """The trained network with what it takes to judge a recording of one subject."""

    subject: likelihood.MeasuredSubject
    truth: Truth
    reference: Beats
    simulations: PriorSimulations
    pool: Pool
    estimator: Sampler
    settings: AcquisitionSeedsStageSettings
    seed: int


def judged_recordings(
    pool: Pool,
    estimator: Sampler,
    subjects: Sequence[likelihood.MeasuredSubject],
    shards: Sequence[Path],
    settings: AcquisitionSeedsStageSettings,
    seed: int,
) -> pd.DataFrame:
    """Return a row for every subject and acquisition seed, judged by a trained network.

    Raises:
        ArtefactError: A subject is no virtual volunteer.
    """
    by_subject = group_by_subject(shards)
    progress = Progress("acquisition seeds", len(subjects) * len(settings.seeds), unit="recording")
    rows = []
    for subject in subjects:
        name = subject.observation.subject
        judge = _Judge(
            subject=subject,
            truth=truth_of(subject.observation.context),
            reference=likelihood.reference_beat(
                subject.observation.context, settings.passive_reference_prior, settings.forward_model
            ),
            simulations=read_simulations(by_subject[name]),
            pool=pool,
            estimator=estimator,
            settings=settings,
            seed=integer_seed(seed, "posterior", name),
        )
        for acquisition_seed in settings.seeds:
            rows.append(_judge(judge, acquisition_seed))
            progress.step(note=f"{name}, seed {acquisition_seed}")
    return seeds_table(rows)


def _judge(judge: _Judge, seed: int) -> SeedRow:
    """Record a subject under one seed and return what the study would say of the recording."""
    settings, context = judge.settings, judge.subject.observation.context
    try:
        recorded = ingest(
            record(judge.truth, seed), context, settings.recording, settings.measurement.grid_points
        )
        passive = calibrate_passive(recorded, judge.reference, settings.passive, settings.measurement)
    except (RecordingError, PassiveCalibrationError) as error:
        return _refused(context.subject, seed, str(error))
    features = features_under(
        judge.subject.passive, recorded, passive, settings.measurement, settings.summary
    )
    z_obs = judge.pool.standardisation.apply(with_context(features[None], context))[0]
    candidates = _candidates(judge, z_obs)
    names = judge.pool.components.names
    verdict = diagnose(z_obs, names, candidates, settings.prior, settings.support)
    measured = likelihood.MeasuredSubject(recorded, passive, settings.measurement)
    theta = candidates[in_bounds(candidates, settings.prior)] if verdict.may_be_read else candidates[:0]
    draws, interval = settings.predictive.draws, settings.predictive.interval
    active = judge.simulations.active_stiffness_kpa[:draws]
    prior = score_cycles(judge.simulations.cycle_phase, active, measured, interval)
    posterior = score_theta(theta[:draws], measured, settings.forward_model, interval)
    return _row(judge, seed, verdict, prior, posterior)


def _candidates(judge: _Judge, z_obs: FloatArray) -> FloatArray:
    support, wanted = judge.settings.support, judge.settings.predictive.draws
    enough = max(support.min_in_prior_draws, wanted)
    return draw_until(
        judge.estimator, z_obs, enough, support.candidate_draws, judge.settings.prior, judge.seed
    )


def _row(judge: _Judge, seed: int, verdict: Verdict, prior: CurveScores, posterior: CurveScores) -> SeedRow:
    criteria = judge.settings.support
    return SeedRow(
        subject=judge.subject.observation.subject,
        acquisition_seed=seed,
        shipped=seed == ACQUISITION_SEED,
        accepted=True,
        within_z=verdict.max_abs_z <= criteria.max_abs_z,
        enough_draws=verdict.in_prior_draws >= criteria.min_in_prior_draws,
        supported=verdict.may_be_read,
        max_abs_z=verdict.max_abs_z,
        worst_component=verdict.worst_component,
        in_prior_draws=verdict.in_prior_draws,
        candidate_draws=verdict.candidate_draws,
        rmse_prior_kpa=prior.grid.rmse_kpa,
        rmse_kpa=posterior.grid.rmse_kpa,
        rmse_reduction_percent=reduction_percent(prior.grid.rmse_kpa, posterior.grid.rmse_kpa),
        r2=posterior.grid.r2,
        coverage_grid=posterior.grid.coverage,
        coverage_phases=posterior.phases.coverage,
        reason="; ".join(verdict.reasons),
    )


def _refused(subject: str, seed: int, reason: str) -> SeedRow:
    LOGGER.info("subject %s, seed %d: recording refused: %s", subject, seed, reason)
    shipped = seed == ACQUISITION_SEED
    return SeedRow(subject=subject, acquisition_seed=seed, shipped=shipped, accepted=False, reason=reason)
