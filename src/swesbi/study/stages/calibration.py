"""Every check of calibration over the whole cohort, and the coverage of known parameters."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import pandas as pd

from swesbi.artefacts import save
from swesbi.base import Settings
from swesbi.checks.calibration.dataset import KIND, join, ranked_of
from swesbi.checks.calibration.ranks import Ranked
from swesbi.checks.calibration.settings import JudgementSettings
from swesbi.checks.calibration.table import LOCAL, POOLED, calibration_table
from swesbi.checks.recovery import Recovered, score_recovery
from swesbi.parameters import THETA_NAMES
from swesbi.prior import PriorSettings
from swesbi.show.csv import write_csv
from swesbi.study.stages.origin import Origin

LOGGER = logging.getLogger("swesbi")


class CalibrationStageSettings(Settings):
    """What is asked of the posteriors, and the prior that contraction is taken against."""

    prior: PriorSettings
    judgement: JudgementSettings


def calibration(
    *,
    recordings: Sequence[Path],
    local_parts: Sequence[Path],
    calibration: Path,
    table: Path,
    recovery: Path,
    recovery_acquisition: Path,
    settings: CalibrationStageSettings,
    origin: Origin,
) -> None:
    """Join the subjects' recordings of known parameters and judge the calibration of the whole cohort.

    Both recoveries score the exact (weighted) posterior, the one that is reported, over all recordings of
    the cohort, none left out; coverage of the network's own draws is in the table beside it.

    Args:
        recordings: Recordings of known parameters, one file a subject.
        local_parts: Calibration at each subject's own data.
        calibration: Output, all of them together.
        table: Output, one row a check.
        recovery: Output, coverage under the model's own noise.
        recovery_acquisition: Output, coverage of recordings acquired sample by sample.

    Raises:
        ArtefactError: An input is no such part.
    """
    groups = join(recordings, local_parts)
    save(calibration, groups, origin.provenance(KIND, settings))
    ranked = {name: ranked_of(groups[name]) for name in ("own", "acquired", LOCAL)}
    checks = calibration_table(ranked, groups["two_samples"], settings.judgement)
    write_csv(table, checks)
    for path, name in ((recovery, "own"), (recovery_acquisition, "acquired")):
        _write_recovery(path, ranked[name], settings)
    _report(checks)


def _write_recovery(path: Path, ranked: Ranked, settings: CalibrationStageSettings) -> None:
    columns, scores = slice(0, len(THETA_NAMES)), ranked.weighted
    recovered = Recovered(
        truth=ranked.truth[:, columns],
        mean=scores.mean[:, columns],
        variance=scores.sd[:, columns] ** 2,
        level_of_truth=scores.level[:, columns],
    )
    rows = score_recovery(recovered, settings.prior, settings.judgement)
    write_csv(path, pd.DataFrame([asdict(row) for row in rows]), float_format=None)


def _report(checks: pd.DataFrame) -> None:
    pooled = checks[checks["subject"] == POOLED]
    for row in pooled[pooled["flagged"] == 1].itertuples():
        LOGGER.info("flagged: %s %s, %s recordings: %s", row.test, row.quantity, row.recordings, row.sampler)
    LOGGER.info("%d of %d checks flagged, %d of them pooled", checks["flagged"].sum(), len(checks),
                pooled["flagged"].sum())  # fmt: skip
