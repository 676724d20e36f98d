"""Stage: how often the misspecification tests raise an alarm, on what."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import pandas as pd

from swesbi.misspecification.dataset import ACQUIRED, OWN, read_subject_checks
from swesbi.misspecification.power import COHORT, STRAINED_OR_WORSE, alarm_rows
from swesbi.misspecification.settings import RuleSettings
from swesbi.settings import Settings
from swesbi.show.csv import write_csv
from swesbi.stages.origin import Origin

LOGGER = logging.getLogger("swesbi")


class MisspecificationTableStageSettings(Settings):
    """The rule whose alarms are counted."""

    rule: RuleSettings


def run(
    *,
    misspecifications: Sequence[Path],
    table: Path,
    settings: MisspecificationTableStageSettings,
    origin: Origin,
) -> None:
    """Count alarms on well-specified recordings and on the virtual volunteers recorded anew.

    Raises:
        ArtefactError: An input is no such artefact.
    """
    rows = alarm_rows([read_subject_checks(path) for path in misspecifications], settings.rule)
    write_csv(table, pd.DataFrame([asdict(row) for row in rows]), float_format=None)
    for row in rows:
        if row.alarm == STRAINED_OR_WORSE and (
            row.subject == COHORT or row.recordings not in (OWN, ACQUIRED)
        ):
            LOGGER.info("%s, %s: alarm on %.1f %% of %d", row.subject, row.recordings, 100 * row.rate, row.n)
