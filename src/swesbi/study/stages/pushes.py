"""Calibration of a population's network on free-running recordings of fresh contexts."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydantic import Field

from swesbi.artefacts import Origin, save
from swesbi.artefacts.csv import write_csv
from swesbi.base.settings import Settings
from swesbi.checks.calibration.pushes import (
    KIND,
    by_pushes,
    infer_pushes,
    pushes_dataset,
    read_pushes,
)
from swesbi.checks.calibration.settings import JudgementSettings, PushesSettings, RecordingsSettings
from swesbi.networks.flow.files import load_flow
from swesbi.population.recordings import FreshSettings
from swesbi.posterior.settings import ExactSettings
from swesbi.prior import JointPriorSettings
from swesbi.verdict.null_recordings import read_nulls
from swesbi.verdict.settings import RuleSettings

LOGGER = logging.getLogger("swesbi")


class PushesCalibrationStageSettings(Settings):
    """What a part depends on."""

    index: tuple[int, int] = Field(description="numbers of its contexts, from the first to before the last")
    free_running: PushesSettings
    fresh: FreshSettings
    sizes: RecordingsSettings
    exact: ExactSettings


def pushes_calibration(
    *, estimator: Path, part: Path, settings: PushesCalibrationStageSettings, origin: Origin
) -> None:
    """Infer free-running recordings of the numbered contexts, one of each number of pushes.

    Raises:
        ArtefactError: The network is no such artefact.
    """
    flow, _ = load_flow(estimator)
    inferred = infer_pushes(
        range(*settings.index), flow, settings.fresh, settings.free_running, settings.sizes, settings.exact,
        origin.seed,
    )  # fmt: skip
    save(part, {"/": pushes_dataset(inferred)}, origin.provenance(KIND, settings))


class PushesTableStageSettings(Settings):
    """What is required of the answers."""

    prior: JointPriorSettings
    judgement: JudgementSettings
    rule: RuleSettings


def pushes_table(
    *,
    parts: Sequence[Path],
    null: Path,
    calibration: Path,
    table: Path,
    settings: PushesTableStageSettings,
    origin: Origin,
) -> None:
    """Join the parts and write coverage by number of pushes.

    Args:
        parts: Free-running recordings of fresh contexts.
        null: Null recordings, against which they are judged.
        calibration: Output, all of them together.
        table: Output, a row a number of pushes, parameter and nominal level.

    Raises:
        ArtefactError: An input is no such artefact.
    """
    inferred = read_pushes(parts)
    save(calibration, {"/": pushes_dataset(inferred)}, origin.provenance(KIND, settings))
    null_pushes = read_nulls(null).pushes
    found = by_pushes(inferred, null_pushes, settings.prior, settings.judgement, settings.rule)
    write_csv(table, found)
    LOGGER.info(
        "%d free-running recordings: median efficiency %.0f %%, %d by MCMC",
        len(inferred.by_mcmc), 100.0 * float(np.median(inferred.efficiency)), int(inferred.by_mcmc.sum()),
    )  # fmt: skip
