"""Stage: credible intervals beside the parameters that made the recordings of a generated cohort."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from swesbi.evaluation.truth import read_truth
from swesbi.inference.dataset import read_posterior
from swesbi.inference.support import read_support
from swesbi.settings import Settings
from swesbi.show.csv import write_csv
from swesbi.show.study_tables import Answer, truth_table
from swesbi.stages.origin import Origin
from swesbi.stages.places import by_place, pick

LOGGER = logging.getLogger("swesbi")


class TruthSettings(Settings):
    """Nothing of the configuration: the table says what the posteriors and the truth say."""


def run(
    *,
    posteriors: Sequence[Path],
    supports: Sequence[Path],
    truth: Path,
    truth_csv: Path,
    settings: TruthSettings,
    origin: Origin,
) -> None:
    """Write the table of every experiment and subject whose posterior is given.

    Raises:
        ArtefactError: A verdict is missing, or a file cannot be read.
    """
    support_of = by_place(supports)
    answers = [
        Answer(
            place.experiment,
            place.subject,
            read_posterior(path),
            read_support(pick(support_of, place, "support verdict")),
        )
        for place, path in by_place(posteriors).items()
    ]
    table = truth_table(answers, read_truth([truth]))
    write_csv(truth_csv, table)
    for experiment, part in table.dropna(subset="inside").groupby("experiment", sort=False):
        inside = part["inside"].astype(bool)
        LOGGER.info("%s: %d of %d true parameters inside", experiment, inside.sum(), len(inside))
