"""Checks of calibration over the cohort, and posteriors beside those of another network."""

from __future__ import annotations

import logging
from dataclasses import asdict
from typing import NamedTuple

import pandas as pd

from swesbi.artefacts.csv import PlainTable, WholeTable
from swesbi.artefacts.typed import BySubject
from swesbi.checks.calibration.alarms import alarm_rows
from swesbi.checks.calibration.dataset import Calibration, CalibrationLocal, CalibrationRecordings
from swesbi.checks.calibration.local import classifier_accuracy
from swesbi.checks.calibration.ranks import NETWORK, WEIGHTED
from swesbi.checks.calibration.settings import JudgementSettings
from swesbi.checks.calibration.table import LOCAL, POOLED, CalibrationTable, calibration_table
from swesbi.checks.recovery import score_recovery
from swesbi.posterior.result import ExactPosterior
from swesbi.prior import JointPriorSettings, PriorSettings
from swesbi.seeds import integer_seed
from swesbi.verdict.null_recordings import NullRecordings
from swesbi.verdict.settings import RuleSettings

LOGGER = logging.getLogger("swesbi")


class CohortCalibration(NamedTuple):
    """Recordings of known parameters of a cohort, and what is made of them.

    Attributes:
        calibration: All recordings together.
        table: One row a check.
        alarms: How often the tests of the verdict raise an alarm.
        recovery: Coverage under the model's own noise.
        recovery_acquisition: Coverage of recordings acquired sample by sample.
    """

    calibration: Calibration
    table: CalibrationTable
    alarms: WholeTable
    recovery: WholeTable
    recovery_acquisition: WholeTable


def calibration_of_cohort(
    recordings: tuple[CalibrationRecordings, ...],
    local_parts: tuple[CalibrationLocal, ...],
    null: NullRecordings,
    *,
    prior: PriorSettings,
    judgement: JudgementSettings,
    rule: RuleSettings,
) -> CohortCalibration:
    """Join the subjects' recordings of known parameters and judge the calibration of the whole cohort.

    Both recoveries score the exact (weighted) posterior, the one that is reported, over all recordings of
    the cohort, none left out; coverage of the network's own draws is in the table beside it.

    Args:
        recordings: Recordings of known parameters, of each subject.
        local_parts: Calibration at each subject's own data.
        null: Null recordings, among which those of known parameters are judged.
        prior: The prior that contraction is taken against.
        judgement: What is required of the posteriors.
        rule: Levels of the verdict.
    """
    found = Calibration.of(recordings, local_parts)
    of_kind = {"model_noise": found.model_noise, "sample_by_sample": found.sample_by_sample}
    ranked = {name: part.ranked for name, part in of_kind.items()}
    table = calibration_table(ranked | {LOCAL: found.local}, found.two_samples, judgement)
    seen = {name: part.misfits for name, part in of_kind.items()}
    alarms = pd.DataFrame([asdict(row) for row in alarm_rows(seen, null.gated, rule)])
    recovery = {
        name: pd.DataFrame([asdict(row) for row in score_recovery(part.recovered(), prior, judgement)])
        for name, part in ranked.items()
    }
    _report(table)
    return CohortCalibration(found, table, alarms, recovery["model_noise"], recovery["sample_by_sample"])


def _report(checks: pd.DataFrame) -> None:
    pooled = checks[checks["subject"] == POOLED]
    for row in pooled[pooled["flagged"] == 1].itertuples():
        LOGGER.info("flagged: %s %s, %s recordings: %s", row.test, row.quantity, row.recordings, row.sampler)
    LOGGER.info("%d of %d checks flagged, %d of them pooled", checks["flagged"].sum(), len(checks),
                pooled["flagged"].sum())  # fmt: skip


def agreement_of_networks(
    posteriors: BySubject[ExactPosterior],
    base_posteriors: BySubject[ExactPosterior],
    *,
    joint_prior: JointPriorSettings,
    two_sample_draws: int,
    seed: int,
) -> PlainTable:
    """Let a classifier tell the draws for each subject from the exact ones of the base experiment.

    Args:
        posteriors: Posteriors of the experiment over a population.
        base_posteriors: Posteriors of its base, of the same subjects.
        joint_prior: Sets the scale of each parameter.
        two_sample_draws: Draws of each sample that a classifier sees.
        seed: Seed of the study.

    Returns:
        Accuracies of the network's own draws ("proposal") and of the exact ones ("weighted").
    """
    rows = []
    for subject, result in posteriors.items():
        exact = base_posteriors[subject].phi[:two_sample_draws]
        for sampler, phi, name in ((NETWORK, result.proposal_phi, "npe"), (WEIGHTED, result.phi, WEIGHTED)):
            stream = integer_seed(seed, "population agreement", subject, name)
            accuracy = classifier_accuracy(phi[:two_sample_draws], exact, joint_prior, stream)
            rows.append({"subject": subject, "sampler": sampler, "draws": len(exact), "c2st": accuracy})
            LOGGER.info("subject %s, %s: C2ST %.3f", subject, sampler, accuracy)
    return pd.DataFrame(rows)
