"""Answers by the network of a population for fresh contexts, whose truth is known."""

from __future__ import annotations

import logging
from dataclasses import asdict
from typing import NamedTuple

import numpy as np
import pandas as pd

from swesbi.artefacts.csv import PlainTable, WholeTable
from swesbi.checks.calibration.alarms import DOUBTFUL_OR_WORSE, alarm_rows, alarms
from swesbi.checks.calibration.dataset import PopulationCalibration
from swesbi.checks.calibration.fresh import FreshRecordings, by_stratum, checks_of, infer_fresh
from swesbi.checks.calibration.settings import JudgementSettings, RecordingsSettings
from swesbi.checks.recovery import score_recovery
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.population.recordings import MODEL_NOISE, SAMPLE_BY_SAMPLE, FreshSettings
from swesbi.population.settings import StrataSettings
from swesbi.posterior.settings import ExactSettings
from swesbi.prior import PriorSettings
from swesbi.verdict.null_recordings import NullRecordings
from swesbi.verdict.settings import RuleSettings

LOGGER = logging.getLogger("swesbi")


def calibration_on_fresh(
    estimator: TrainedFlow,
    *,
    model_noise_numbers: tuple[int, int],
    sample_by_sample_numbers: tuple[int, int],
    fresh: FreshSettings,
    recordings: RecordingsSettings,
    exact: ExactSettings,
    seed: int,
) -> PopulationCalibration:
    """Infer one recording of each of the numbered contexts, under the model's own noise and acquired.

    Args:
        estimator: The network.
        model_noise_numbers: Contexts recorded under the model's own noise: the first, one past the last.
        sample_by_sample_numbers: The same of those acquired sample by sample.
        fresh: Where contexts and recordings come from.
        recordings: Draws of each posterior.
        exact: The study's own settings of the exact posterior.
        seed: The study's seed.

    Raises:
        ValueError: Ingestion refused every recording.
    """
    own, acquired = (
        infer_fresh(range(*numbers), kind, estimator, fresh, recordings, exact, seed)
        for kind, numbers in (
            (MODEL_NOISE, model_noise_numbers),
            (SAMPLE_BY_SAMPLE, sample_by_sample_numbers),
        )
    )
    return PopulationCalibration(own, acquired)


class PopulationScores(NamedTuple):
    """Recordings of fresh contexts, and what is made of them.

    Attributes:
        calibration: All recordings together.
        table: One row a check.
        strata: Coverage and false alarms by sampler and stratum.
        alarms: How often the tests of the verdict raise an alarm.
        recovery: Coverage of the exact posterior under the model's own noise.
        recovery_acquisition: Coverage of recordings acquired sample by sample.
    """

    calibration: PopulationCalibration
    table: PlainTable
    strata: PlainTable
    alarms: WholeTable
    recovery: WholeTable
    recovery_acquisition: WholeTable


def scores_on_fresh(
    parts: PopulationCalibration,
    null: NullRecordings,
    *,
    prior: PriorSettings,
    judgement: JudgementSettings,
    strata: StrataSettings,
    rule: RuleSettings,
) -> PopulationScores:
    """Judge calibration on fresh contexts, over all of them and by stratum.

    Args:
        parts: Recordings of fresh contexts.
        null: Null recordings, among which they are judged.
        prior: The prior that contraction is taken against.
        judgement: What is required of the posteriors.
        strata: Where continuous values are cut.
        rule: Levels of the verdict.
    """
    inferred = {MODEL_NOISE: parts.model_noise, SAMPLE_BY_SAMPLE: parts.sample_by_sample}
    seen = {kind: part.inferred.misfits for kind, part in inferred.items()}
    raised = alarms(seen[MODEL_NOISE], null.gated, rule)[DOUBTFUL_OR_WORSE]
    recovery = {
        kind: [asdict(row) for row in score_recovery(part.inferred.ranked.recovered(), prior, judgement)]
        for kind, part in inferred.items()
    }
    _report(inferred)
    return PopulationScores(
        calibration=parts,
        table=checks_of(inferred, judgement),
        strata=by_stratum(parts.model_noise, raised, prior, judgement, strata),
        alarms=pd.DataFrame([asdict(row) for row in alarm_rows(seen, null.gated, rule)]),
        recovery=pd.DataFrame(recovery[MODEL_NOISE]),
        recovery_acquisition=pd.DataFrame(recovery[SAMPLE_BY_SAMPLE]),
    )


def _report(inferred: dict[str, FreshRecordings]) -> None:
    for kind, recordings in inferred.items():
        diagnostics = recordings.inferred.diagnostics
        LOGGER.info(
            "%d %s recordings (%d refused): median efficiency %.0f %%, %d by MCMC",
            len(recordings.contexts), kind, recordings.refused,
            100.0 * float(np.median(diagnostics.efficiency)), int(diagnostics.by_mcmc.sum()),
        )  # fmt: skip
