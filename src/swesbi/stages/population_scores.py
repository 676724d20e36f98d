"""Stage: calibration on fresh contexts, judged over all of them and by stratum."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pandas as pd

from swesbi.artefacts import save
from swesbi.calibration.settings import JudgementSettings
from swesbi.population.calibration import FreshInferred, StrataSettings
from swesbi.population.calibration_dataset import KIND, fresh_of, join
from swesbi.population.recordings import ACQUIRED, OWN
from swesbi.population.scores import Judge
from swesbi.settings import Settings
from swesbi.show.csv import write_csv
from swesbi.simulations.prior import PriorSettings
from swesbi.stages.origin import Origin

LOGGER = logging.getLogger("swesbi")


class PopulationScoresStageSettings(Settings):
    """What is asked of the answers."""

    prior: PriorSettings
    judgement: JudgementSettings
    strata: StrataSettings


def run(
    *,
    parts: Sequence[Path],
    calibration: Path,
    table: Path,
    strata: Path,
    recovery: Path,
    recovery_acquisition: Path,
    settings: PopulationScoresStageSettings,
    origin: Origin,
) -> None:
    """Join the parts and judge them.

    Args:
        parts: Recordings of fresh contexts.
        calibration: Output, all of them together.
        table: Output, one row a check.
        strata: Output, coverage by sampler and stratum.
        recovery: Output, coverage of the exact posterior under the model's own noise.
        recovery_acquisition: Output, of recordings acquired sample by sample.
        settings: What is asked.
        origin: Whose work this is.

    Raises:
        ArtefactError: An input is no such part.
    """
    groups = join(parts)
    save(calibration, groups, origin.provenance(KIND, settings))
    found = {kind: fresh_of(group) for kind, group in groups.items()}
    judge = Judge(settings.prior, settings.judgement, settings.strata)
    write_csv(table, judge.checks(found))
    write_csv(strata, judge.by_stratum(found[OWN]))
    for path, kind in ((recovery, OWN), (recovery_acquisition, ACQUIRED)):
        rows = [asdict(row) for row in judge.recovery(found[kind].inferred.ranked)]
        write_csv(path, pd.DataFrame(rows), float_format=None)
    _report(found)


def _report(found: dict[str, FreshInferred]) -> None:
    for kind, part in found.items():
        diagnostics = part.inferred.diagnostics
        LOGGER.info(
            "%d %s recordings (%d refused): median efficiency %.0f %%, %d by MCMC",
            len(part.contexts), kind, part.refused, 100.0 * float(np.median(diagnostics.efficiency)),
            int(diagnostics.by_mcmc.sum()),
        )  # fmt: skip
