"""Answers by the network of a population for fresh contexts, whose truth is known."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pandas as pd

from swesbi.artefacts import Origin, save
from swesbi.artefacts.csv import write_csv
from swesbi.base.settings import Settings
from swesbi.checks.calibration.alarms import STRAINED_OR_WORSE, alarm_rows
from swesbi.checks.calibration.alarms import alarms as raised_alarms
from swesbi.checks.calibration.dataset import FRESH as KIND
from swesbi.checks.calibration.dataset import fresh_dataset, fresh_of
from swesbi.checks.calibration.dataset import join_fresh as join
from swesbi.checks.calibration.fresh import FreshInferred, by_stratum, checks_of, infer_fresh
from swesbi.checks.calibration.settings import JudgementSettings, RecordingsSettings
from swesbi.checks.recovery import score_recovery
from swesbi.networks.flow.files import load_flow
from swesbi.population.recordings import ACQUIRED, OWN, FreshSettings
from swesbi.population.settings import StrataSettings
from swesbi.posterior.settings import ExactSettings
from swesbi.prior import PriorSettings
from swesbi.verdict.null_recordings import read_nulls
from swesbi.verdict.settings import RuleSettings

LOGGER = logging.getLogger("swesbi")


class PopulationCalibrationStageSettings(Settings):
    """What a part depends on."""

    own: tuple[int, int]
    acquired: tuple[int, int]
    fresh: FreshSettings
    sizes: RecordingsSettings
    exact: ExactSettings


def population_calibration(
    *, estimator: Path, part: Path, settings: PopulationCalibrationStageSettings, origin: Origin
) -> None:
    """Infer one recording of each of the numbered contexts, under the model's own noise and acquired.

    Raises:
        ArtefactError: The network is no such artefact.
    """
    flow, _ = load_flow(estimator)
    numbers = {OWN: range(*settings.own), ACQUIRED: range(*settings.acquired)}
    groups = {
        kind: fresh_dataset(
            infer_fresh(
                index,
                kind,
                flow,
                settings.fresh,
                settings.sizes,
                settings.exact,
                origin.seed,
            )
        )
        for kind, index in numbers.items()
    }
    save(part, groups, origin.provenance(KIND, settings))


class PopulationScoresStageSettings(Settings):
    """What is required of the answers."""

    prior: PriorSettings
    judgement: JudgementSettings
    strata: StrataSettings
    rule: RuleSettings


def population_scores(
    *,
    parts: Sequence[Path],
    null: Path,
    calibration: Path,
    table: Path,
    strata: Path,
    alarms: Path,
    recovery: Path,
    recovery_acquisition: Path,
    settings: PopulationScoresStageSettings,
    origin: Origin,
) -> None:
    """Join the parts and judge calibration on fresh contexts, over all of them and by stratum.

    Args:
        parts: Recordings of fresh contexts.
        null: Null recordings, among which they are judged.
        calibration: Output, all of them together.
        table: Output, one row a check.
        strata: Output, coverage and false alarms by sampler and stratum.
        alarms: Output, how often the tests of the verdict raise an alarm.
        recovery: Output, coverage of the exact posterior under the model's own noise.
        recovery_acquisition: Output, of recordings acquired sample by sample.

    Raises:
        ArtefactError: An input is no such part.
    """
    groups = join(parts)
    save(calibration, groups, origin.provenance(KIND, settings))
    inferred = {kind: fresh_of(group) for kind, group in groups.items()}
    prior, judgement = settings.prior, settings.judgement
    write_csv(table, checks_of(inferred, judgement))
    seen, gated = {kind: part.inferred.checks for kind, part in inferred.items()}, read_nulls(null).gated
    raised = raised_alarms(seen[OWN], gated, settings.rule)[STRAINED_OR_WORSE]
    write_csv(strata, by_stratum(inferred[OWN], raised, prior, judgement, settings.strata))
    rows = [asdict(row) for row in alarm_rows(seen, gated, settings.rule)]
    write_csv(alarms, pd.DataFrame(rows), float_format=None)
    for path, kind in ((recovery, OWN), (recovery_acquisition, ACQUIRED)):
        recovered = inferred[kind].inferred.ranked.recovered()
        rows = [asdict(row) for row in score_recovery(recovered, prior, judgement)]
        write_csv(path, pd.DataFrame(rows), float_format=None)
    _report(inferred)


def _report(inferred: dict[str, FreshInferred]) -> None:
    for kind, recordings in inferred.items():
        diagnostics = recordings.inferred.diagnostics
        LOGGER.info(
            "%d %s recordings (%d refused): median efficiency %.0f %%, %d by MCMC",
            len(recordings.contexts), kind, recordings.refused,
            100.0 * float(np.median(diagnostics.efficiency)), int(diagnostics.by_mcmc.sum()),
        )  # fmt: skip
