"""How recovery, posteriors and predictions of an experiment evolve with the epochs of training."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydantic import Field
from scipy.special import stdtrit

from swesbi.artefacts import ArtefactError, Origin
from swesbi.artefacts.csv import write_csv
from swesbi.base.progress import Progress
from swesbi.checks.draws import score_theta
from swesbi.checks.recovery import NothingRecoveredError, recover, score_recovery
from swesbi.checks.settings import PredictiveSettings
from swesbi.measurement.likelihood import MeasuredSubject, read_measured_subjects
from swesbi.networks.paper.estimator import Checkpoint, load_checkpoints
from swesbi.networks.paper.maf import draw_candidates, draw_until, losses
from swesbi.networks.paper.pool import read_pool
from swesbi.parameters import THETA_NAMES
from swesbi.prior import in_bounds, prior_variance
from swesbi.report import training_tables
from swesbi.seeds import integer_seed
from swesbi.study.stages import inference
from swesbi.study.stages.origin import by_key
from swesbi.verdict.settings import SupportSettings
from swesbi.verdict.verdict import read_verdict

LOGGER = logging.getLogger("swesbi")
FloatArray = NDArray[np.float64]
EpochRow = dict[str, object]


class EpochsStageSettings(inference.RecoveryStageSettings):
    """What the study over epochs depends on; recovery is that of the experiment."""

    support: SupportSettings
    predictive: PredictiveSettings
    candidate_draws: int = Field(ge=1, description="draws from each checkpoint for a subject, at most")


def epochs(
    *,
    pool: Path,
    checkpoints: Path,
    observations: Sequence[Path],
    passives: Sequence[Path],
    verdicts: Sequence[Path],
    epochs: Path,
    settings: EpochsStageSettings,
    origin: Origin,
) -> None:
    """Write what each checkpoint of a training says of synthetic recordings and of the subjects.

    Recordings and draws are those of the recovery and of the posteriors, so the rows of the best epoch
    agree with the experiment's own results, save that the posterior sd is of the first draws, not of all.
    Whose posterior may be interpreted is the study's verdict.

    Raises:
        ArtefactError: An input does not fit the others.
    """
    data, (nets, _) = read_pool(pool), load_checkpoints(checkpoints)
    subjects = read_measured_subjects(observations, passives, settings.measurement)
    readable = {key.subject: read_verdict(path).may_be_read for key, path in by_key(verdicts).items()}
    if missing := [s.observation.subject for s in subjects if s.observation.subject not in readable]:
        raise ArtefactError(f"no verdict of subject {missing[0]} is given")
    truth, raw = inference.synthetic_recordings(subjects, settings, origin.seed)
    z = data.standardisation.apply(raw)
    rows: list[EpochRow] = []
    progress = Progress("epochs", len(nets), unit="checkpoint")
    for net in nets:
        inference.check_components(data, net, checkpoints)
        rows.append(_row(net, training_tables.VALIDATION_LOSS, value=net.validation_loss))
        rows.append(_fresh_loss(net, truth, z, settings.recovery.confidence))
        rows.extend(_recovery_rows(net, truth, z, settings, origin.seed))
        for subject in subjects:
            name = subject.observation.subject
            z_obs, seed = data.observed_z(name), integer_seed(origin.seed, "posterior", name)
            rows.extend(_subject_rows(net, subject, readable[name], z_obs, seed, settings))
        progress.step(note=f"epoch {net.epoch}")
    write_csv(epochs, pd.DataFrame(rows))


def _row(net: Checkpoint, quantity: str, **values: object) -> EpochRow:
    """Return one quantity after one epoch.

    ``best`` is 1 where the study uses the network of this epoch. The value is NaN where too few draws lie
    within the prior's bounds, or the subject is not prior-supported; ``ci_low`` and ``ci_high`` are the
    interval on a mean or a coverage over synthetic recordings; ``n`` recordings or draws are behind it.
    """
    of = {"epoch": net.epoch, "best": int(net.best), "quantity": quantity, "subject": "", "parameter": ""}
    return of | {"value": np.nan, "ci_low": np.nan, "ci_high": np.nan, "n": 0} | values


def _fresh_loss(net: Checkpoint, truth: FloatArray, z: FloatArray, confidence: float) -> EpochRow:
    """Return the mean loss of synthetic recordings, whose theta no training has seen, with a t interval.

    Augmentations of one simulation stand on both sides of the split into training and validation; here
    none does.
    """
    each = losses(net, truth, z)
    standard_error = each.std(ddof=1) / np.sqrt(len(each))
    half = standard_error * stdtrit(len(each) - 1, 0.5 + 0.5 * confidence)
    mean = float(each.mean())
    return _row(
        net, training_tables.FRESH_LOSS, value=mean, ci_low=mean - half, ci_high=mean + half, n=len(each)
    )


def _recovery_rows(
    net: Checkpoint, truth: FloatArray, z: FloatArray, settings: EpochsStageSettings, seed: int
) -> Iterator[EpochRow]:
    """Yield the coverage of synthetic recordings at the level of the predictive interval, by parameter."""
    level = settings.predictive.interval
    at_level = settings.recovery.model_copy(update={"nominal_levels": (level,)})
    candidates = draw_candidates(net, z, settings.recovery.candidate_draws, inference.posterior_seed(seed))
    try:
        recovered = recover(truth, candidates, settings.prior, at_level)
    except NothingRecoveredError:
        LOGGER.info("epoch %d: no synthetic recording has enough draws in the prior's bounds", net.epoch)
        yield from (_row(net, training_tables.RECOVERY_COVERAGE, parameter=name) for name in THETA_NAMES)
        return
    for row in score_recovery(recovered, settings.prior, at_level):
        yield _row(
            net,
            training_tables.RECOVERY_COVERAGE,
            parameter=row.parameter,
            value=row.coverage,
            ci_low=row.ci_low,
            ci_high=row.ci_high,
            n=row.n,
        )


def _subject_rows(
    net: Checkpoint,
    subject: MeasuredSubject,
    readable: bool,
    z_obs: FloatArray,
    seed: int,
    settings: EpochsStageSettings,
) -> Iterator[EpochRow]:
    """Yield width and predictive scores of one subject's posterior under one checkpoint."""
    name, required = subject.observation.subject, settings.support.min_in_prior_draws
    wanted = settings.predictive.draws
    enough = max(required, wanted)
    candidates = draw_until(net, z_obs, enough, settings.candidate_draws, settings.prior, seed)
    inside = candidates[in_bounds(candidates, settings.prior)]
    yield _row(
        net, training_tables.IN_PRIOR, subject=name, value=len(inside) / len(candidates), n=len(candidates)
    )
    theta = inside if len(inside) >= required else inside[:0]
    for parameter, value in zip(THETA_NAMES, _relative_sd(theta, settings), strict=True):
        yield _row(
            net, training_tables.RELATIVE_SD, subject=name, parameter=parameter, value=value, n=len(theta)
        )
    shown = theta[:wanted] if readable else theta[:0]
    scores = score_theta(shown, subject, settings.forward_model, settings.predictive.interval)
    yield _row(net, training_tables.COVERAGE_PHASES, subject=name, value=scores.phases.coverage, n=len(shown))
    yield _row(net, training_tables.COVERAGE_GRID, subject=name, value=scores.grid.coverage, n=len(shown))
    yield _row(net, training_tables.RMSE, subject=name, value=scores.grid.rmse_kpa, n=len(shown))


def _relative_sd(theta: FloatArray, settings: EpochsStageSettings) -> FloatArray:
    """Return posterior over prior standard deviation, shape (3,); NaN without draws."""
    if len(theta) == 0:
        return np.full(len(THETA_NAMES), np.nan)
    ratio: FloatArray = theta.std(axis=0, ddof=1) / np.sqrt(prior_variance(settings.prior))
    return ratio
