"""How recovery, posteriors and predictions of an experiment evolve with the epochs of training."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from swesbi.artefacts.typed import BySubject
from swesbi.base.arrays import FloatArray
from swesbi.base.progress import Progress
from swesbi.checks.recovery import NothingRecoveredError, posterior_seed, recovery_table, synthetic_recordings
from swesbi.checks.scores import NO_SCORES, Scores, band, score
from swesbi.checks.settings import PredictiveSettings, RecoverySettings
from swesbi.heart.periodic import Status
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import simulate
from swesbi.measurement.likelihood import MeasuredSubject, measured_subjects
from swesbi.measurement.operator import PassiveBaseline
from swesbi.measurement.settings import MeasurementSettings, SummarySettings
from swesbi.networks import training as trainings
from swesbi.networks.paper.estimator import Checkpoints, TrainedEstimator, draw_candidates, draw_until, losses
from swesbi.networks.paper.pool import Pool
from swesbi.networks.settings import ObservationModelSettings
from swesbi.networks.training import EpochsTable
from swesbi.parameters import THETA_NAMES
from swesbi.prior import PriorSettings, in_bounds, prior_variance
from swesbi.recording.observation import Observation
from swesbi.seeds import integer_seed
from swesbi.verdict.settings import SupportSettings
from swesbi.verdict.verdict import Verdict

LOGGER = logging.getLogger("swesbi")
EpochRow = dict[str, object]


@dataclass(frozen=True)
class _CheckpointSettings:
    """What is asked of every checkpoint."""

    prior: PriorSettings
    forward_model: ForwardModelSettings
    recovery: RecoverySettings
    support: SupportSettings
    predictive: PredictiveSettings
    candidate_draws: int
    seed: int


def inference_by_epoch(
    pool: Pool,
    checkpoints: Checkpoints,
    observations: tuple[Observation, ...],
    passives: BySubject[PassiveBaseline],
    verdicts: BySubject[Verdict],
    *,
    prior: PriorSettings,
    forward_model: ForwardModelSettings,
    measurement: MeasurementSettings,
    summary: SummarySettings,
    observation_model: ObservationModelSettings,
    recovery: RecoverySettings,
    support: SupportSettings,
    predictive: PredictiveSettings,
    candidate_draws: int,
    seed: int,
) -> EpochsTable:
    """Tell what each checkpoint of a training says of synthetic recordings and of the subjects.

    Recordings and draws are those of the recovery and of the posteriors, so the rows of the best epoch agree
    with the experiment's own results, save that the posterior sd is of the first draws, not of all. Whose
    posterior may be interpreted is the study's verdict.
    """
    pool.check_components(checkpoints.best.components, "checkpoints")
    subjects = measured_subjects(observations, passives, measurement)
    readable = {subject: verdicts[subject].may_be_read for subject in passives}
    truth, raw = synthetic_recordings(
        subjects,
        recovery.recordings,
        prior=prior,
        forward_model=forward_model,
        summary=summary,
        observation_model=observation_model,
        seed=seed,
    )
    asked = _CheckpointSettings(prior, forward_model, recovery, support, predictive, candidate_draws, seed)
    z = pool.standardisation.apply(raw)
    rows: list[EpochRow] = []
    progress = Progress("epochs", len(checkpoints.of_epochs), unit="checkpoint")
    for net in checkpoints.of_epochs:
        rows.append(_row(net, trainings.VALIDATION_LOSS, value=net.validation_loss))
        rows.append(_fresh_loss(net, truth, z, recovery.confidence))
        rows.extend(_recovery_rows(net, truth, z, asked))
        for subject in subjects:
            name = subject.observation.subject
            rows.extend(_subject_rows(net, subject, readable[name], pool.observed_z(name), asked))
        progress.step(note=f"epoch {net.epoch}")
    return pd.DataFrame(rows)


def _row(net: TrainedEstimator, quantity: str, **values: object) -> EpochRow:
    """Return one quantity after one epoch.

    ``best`` is 1 where the study uses the network of this epoch. The value is NaN where too few draws lie
    within the prior's bounds, or the subject is not prior-supported; the interval is on a mean or a coverage
    over synthetic recordings; ``n`` recordings or draws are behind it.
    """
    of = {"epoch": net.epoch, "best": int(net.best), "quantity": quantity, "subject": "", "parameter": ""}
    return of | {"value": np.nan, "ci_low": np.nan, "ci_high": np.nan, "n": 0} | values


def _fresh_loss(net: TrainedEstimator, truth: FloatArray, z: FloatArray, confidence: float) -> EpochRow:
    """Return the mean loss of synthetic recordings, whose theta no training has seen, with a t interval.

    Augmentations of one simulation stand on both sides of the split into training and validation; here
    none does.
    """
    each = losses(net, truth, z)
    standard_error = each.std(ddof=1) / np.sqrt(len(each))
    half = standard_error * stdtrit(len(each) - 1, 0.5 + 0.5 * confidence)
    mean = float(each.mean())
    return _row(net, trainings.FRESH_LOSS, value=mean, ci_low=mean - half, ci_high=mean + half, n=len(each))


def _recovery_rows(
    net: TrainedEstimator, truth: FloatArray, z: FloatArray, asked: _CheckpointSettings
) -> Iterator[EpochRow]:
    """Yield the coverage of synthetic recordings at the level of the predictive interval, by parameter."""
    level = asked.predictive.interval
    at_level = asked.recovery.model_copy(update={"nominal_levels": (level,)})
    candidates = draw_candidates(net, z, asked.recovery.candidate_draws, posterior_seed(asked.seed))
    try:
        recovered = recovery_table(truth, candidates, asked.prior, at_level)
    except NothingRecoveredError:
        LOGGER.info("epoch %d: no synthetic recording has enough draws in the prior's bounds", net.epoch)
        yield from (_row(net, trainings.RECOVERY_COVERAGE, parameter=name) for name in THETA_NAMES)
        return
    for row in recovered.itertuples():
        yield _row(
            net,
            trainings.RECOVERY_COVERAGE,
            parameter=row.parameter,
            value=row.coverage,
            ci_low=row.ci_low,
            ci_high=row.ci_high,
            n=row.n,
        )


def _subject_rows(
    net: TrainedEstimator,
    subject: MeasuredSubject,
    readable: bool,
    z_obs: FloatArray,
    asked: _CheckpointSettings,
) -> Iterator[EpochRow]:
    """Yield width and predictive scores of one subject's posterior under one checkpoint."""
    name, required = subject.observation.subject, asked.support.min_in_prior_draws
    wanted, seed = asked.predictive.draws, integer_seed(asked.seed, "posterior", name)
    enough = max(required, wanted)
    candidates = draw_until(net, z_obs, enough, asked.candidate_draws, asked.prior, seed)
    inside = candidates[in_bounds(candidates, asked.prior)]
    yield _row(net, trainings.IN_PRIOR, subject=name, value=len(inside) / len(candidates), n=len(candidates))
    theta = inside if len(inside) >= required else inside[:0]
    for parameter, value in zip(THETA_NAMES, _relative_sd(theta, asked.prior), strict=True):
        yield _row(net, trainings.RELATIVE_SD, subject=name, parameter=parameter, value=value, n=len(theta))
    shown = theta[:wanted] if readable else theta[:0]
    grid, phases = _score(shown, subject, asked.forward_model, asked.predictive.interval)
    yield _row(net, trainings.COVERAGE_PHASES, subject=name, value=phases.coverage, n=len(shown))
    yield _row(net, trainings.COVERAGE_GRID, subject=name, value=grid.coverage, n=len(shown))
    yield _row(net, trainings.RMSE, subject=name, value=grid.rmse_kpa, n=len(shown))


def _score(
    theta: FloatArray, subject: MeasuredSubject, forward_model: ForwardModelSettings, interval: float
) -> tuple[Scores, Scores]:
    """Score the curves of theta (n, 3) that can be simulated, on the grid and at the measured phases.

    The scores are NaN where n is 0.
    """
    if not len(theta):
        return NO_SCORES, NO_SCORES
    recording = subject.observation
    beats = simulate(theta, recording.context, forward_model)
    cycles = (beats.cycle_phase, beats.active_stiffness_kpa[beats.status == Status.PERIODIC])
    grid, phases = subject.on_grid(*cycles), subject.at_phases(*cycles)[:, recording.measured]
    observed, phase = recording.stiffness_kpa[recording.measured], recording.phase[recording.measured]
    return (
        score(recording.grid, recording.curve_kpa, band(grid, interval)),
        score(phase, observed, band(phases, interval)),
    )


def _relative_sd(theta: FloatArray, prior: PriorSettings) -> FloatArray:
    """Return posterior over prior standard deviation, shape (3,); NaN without draws."""
    if len(theta) == 0:
        return np.full(len(THETA_NAMES), np.nan)
    ratio: FloatArray = theta.std(axis=0, ddof=1) / np.sqrt(prior_variance(prior))
    return ratio
