"""``calibration.csv``: every check of every set of recordings, pooled and by subject."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Final

import pandas as pd
import xarray as xr

from swesbi.calibration.checks import Check, c2st_check, check_scores
from swesbi.calibration.quantities import QUANTITY_NAMES
from swesbi.calibration.ranked import SAMPLERS, Ranked
from swesbi.calibration.settings import JudgementSettings

POOLED: Final = "pooled"
LOCAL: Final = "local"
NONE_LOST: Final = 0.0  # a second recording must not widen the posterior that the first one gave
COLUMNS: Final = (
    "subject",
    "recordings",
    "sampler",
    "test",
    "quantity",
    "n",
    "statistic",
    "p_value",
    "limit",
    "flagged",
    "coverage_90",
    "contraction",
)


def calibration_table(
    ranked: Mapping[str, Ranked], two_samples: xr.Dataset, settings: JudgementSettings
) -> pd.DataFrame:
    """Return one row a check.

    ``limit`` is shared (Bonferroni) by the quantities of one set of bands, and in rows of single subjects by
    the subjects too. At the subjects' own data ("local") contraction is against the posterior given the
    first recording, and must only be above zero: how much more a second one tells is the subject's matter.
    In rows of "c2st", ``sampler`` is the pair that is told apart.

    Args:
        ranked: Recordings by how they were made: "own", "acquired" or "local".
        two_samples: Accuracies of classifiers by subject and pair of samplers.
        settings: What is asked.
    """
    rows = [row for name, part in ranked.items() for row in _of_recordings(name, part, settings)]
    rows.extend(_of_two_samples(two_samples, settings.max_c2st))
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _of_recordings(name: str, ranked: Ranked, settings: JudgementSettings) -> Iterator[dict[str, object]]:
    subjects = list(dict.fromkeys(ranked.subject.tolist()))
    parts = {subject: ranked.rows(ranked.subject == subject) for subject in subjects}
    for sampler in SAMPLERS:
        if name != LOCAL:
            checks = _checks(ranked, sampler, settings, settings.least_contraction, 1)
            yield from _labelled(POOLED, name, sampler, checks)
        for subject, part in parts.items():
            least = settings.least_contraction if name != LOCAL else NONE_LOST
            checks = _checks(part, sampler, settings, least, len(subjects))
            yield from _labelled(subject, name, sampler, checks)


def _checks(
    ranked: Ranked, sampler: str, settings: JudgementSettings, least: float, groups: int
) -> tuple[Check, ...]:
    return check_scores(
        ranked.of(sampler), ranked.prior_variance, QUANTITY_NAMES, settings.alpha, least, groups
    )


def _of_two_samples(two_samples: xr.Dataset, limit: float) -> Iterator[dict[str, object]]:
    for subject in two_samples["subject"].to_numpy():
        part = two_samples.sel(subject=subject)
        for pair in part["pair"].to_numpy():
            accuracy = float(part["accuracy"].sel(pair=pair))
            check = c2st_check("joint", int(part["draws"]), accuracy, limit)
            yield from _labelled(str(subject), LOCAL, str(pair), (check,))


def _labelled(
    subject: str, recordings: str, sampler: str, checks: tuple[Check, ...]
) -> Iterator[dict[str, object]]:
    for check in checks:
        labels = {"subject": subject, "recordings": recordings, "sampler": sampler}
        yield labels | asdict(check) | {"flagged": int(check.flagged)}
