"""How well the answers to fresh contexts are calibrated: over all of them, and by stratum."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Final

import numpy as np
import pandas as pd

from swesbi.calibration.checks import check_scores
from swesbi.calibration.quantities import QUANTITY_NAMES
from swesbi.calibration.ranked import SAMPLERS, WEIGHTED, Ranked
from swesbi.calibration.settings import JudgementSettings
from swesbi.inference.recovery import Recovered, RecoveryRow, score_recovery
from swesbi.parameters import THETA_NAMES
from swesbi.population.calibration import FreshInferred, strata
from swesbi.population.settings import StrataSettings
from swesbi.prior import PriorSettings

ALL: Final = "all"


@dataclass(frozen=True)
class Judge:
    """What is asked of the answers.

    Attributes:
        prior: Prior of theta, against which contraction is taken.
        judgement: Levels and limits.
        strata: Where continuous values are cut.
    """

    prior: PriorSettings
    judgement: JudgementSettings
    strata: StrataSettings

    def recovery(self, ranked: Ranked, sampler: str = WEIGHTED) -> tuple[RecoveryRow, ...]:
        """Return coverage, bias and contraction of each active parameter at each nominal level."""
        columns, scores = slice(0, len(THETA_NAMES)), ranked.of(sampler)
        recovered = Recovered(
            truth=ranked.truth[:, columns],
            mean=scores.mean[:, columns],
            variance=scores.sd[:, columns] ** 2,
            level_of_truth=scores.level[:, columns],
        )
        return score_recovery(recovered, self.prior, self.judgement)

    def by_stratum(self, found: FreshInferred) -> pd.DataFrame:
        """Return coverage by sampler and stratum, with the efficiency of the weights in each."""
        parts = {ALL: np.ones(len(found.contexts), dtype=bool)}
        parts |= strata(found.contexts, found.relative_se, self.strata)
        rows = [row for sampler in SAMPLERS for row in self._rows(found, parts, sampler)]
        return pd.DataFrame(rows)

    def checks(self, found: dict[str, FreshInferred]) -> pd.DataFrame:
        """Return one row a check over all fresh contexts, by kind of recording and sampler."""
        rows: list[dict[str, object]] = []
        for kind, part in found.items():
            for sampler in SAMPLERS:
                ranked = part.inferred.ranked
                checks = check_scores(
                    ranked.of(sampler), ranked.prior_variance, QUANTITY_NAMES,
                    self.judgement.alpha, self.judgement.least_contraction,
                )  # fmt: skip
                labels = {"recordings": kind, "sampler": sampler}
                rows.extend(labels | asdict(one) | {"flagged": int(one.flagged)} for one in checks)
        return pd.DataFrame(rows)

    def _rows(
        self, found: FreshInferred, parts: dict[str, np.typing.NDArray[np.bool_]], sampler: str
    ) -> Iterator[dict[str, object]]:
        for name, chosen in parts.items():
            if not chosen.any():
                continue
            median = float(np.median(found.inferred.diagnostics.efficiency[chosen]))
            for row in self.recovery(found.inferred.ranked.rows(chosen), sampler):
                labels = {"sampler": sampler, "stratum": name}
                yield labels | asdict(row) | {"median_efficiency": median}
