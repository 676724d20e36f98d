"""Persons who came twice, without hearts: log theta of each visit is measured with normal errors.

The posterior of both visits alone is then two truncated normals. What truly changed is normal between the
persons of a group, and the earlier visit has the prior given the change, by rejection from the prior.
"""

from __future__ import annotations

from collections.abc import Sequence

import hierarchy_case as case
import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.persons.cohort.cohort import Member, make_member
from swesbi.persons.cohort.infer import CohortResult, infer_population, of_ratios
from swesbi.persons.cohort.settings import ChangeGroupsSettings
from swesbi.prior import bounds

ERROR_SD = np.array([0.06, 0.15, 0.12])
"""Of log theta at one visit: about what a person's visits leave when much of what is not known is shared."""
DRAWS = 1000
EFFORT = case.SETTINGS.model_copy(
    update={
        "exact": case.EXACT.model_copy(
            update={
                "effective_draws": 600,
                "min_effective_draws": 200,
                "draws": 1000,
            }
        )
    }
)
"""Sizes of the posterior; a study's are larger."""
SETTINGS = ChangeGroupsSettings.from_plain(
    {
        "draws": DRAWS,
        "least_effective": 40.0,
        "hyperprior": {
            "median": {"centre": 1.0, "log_sd": 0.4, "low": 0.202, "high": 4.954},
            "spread": {"centre": 0.12, "log_sd": 0.6, "low": 0.03, "high": 0.6},
            "group_factor": {"centre": 1.0, "log_sd": 0.4, "low": 0.202, "high": 4.954},
        },
    }
)


def true_ratios(mean: FloatArray, spread: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Draw the log ratio of each person, (d, 3), about the means (d, 3) of their groups."""
    return np.asarray(mean + spread * rng.standard_normal(mean.shape))


def visits(delta: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Draw log theta (d, 3) of both visits from the prior of both, given their differences (d, 3)."""
    low, high = (np.log(limit) for limit in bounds(case.THETA_PRIOR))
    centre = np.log([each.centre for each in case.THETA_PRIOR.parameters])
    sd = np.array([each.log_sd for each in case.THETA_PRIOR.parameters])
    # the product of both normal densities is normal about the middle, of sd / sqrt(2)
    least, most = np.maximum(low, low - delta), np.minimum(high, high - delta)
    earlier = case.truncated(centre - 0.5 * delta, sd / np.sqrt(2.0) + 0.0 * delta, least, most, rng)
    return earlier, earlier + delta


def measured_visits(
    delta: FloatArray, seed: int, error_sd: FloatArray = ERROR_SD
) -> tuple[case.Measured, case.Measured]:
    """Measure both visits of persons with these true log ratios (d, 3)."""
    rng = np.random.default_rng(seed)
    earlier, later = (
        case.Measured(log_theta + error_sd * rng.standard_normal(delta.shape), error_sd + 0.0 * delta)
        for log_theta in visits(delta, rng)
    )
    return earlier, later


def members_of(
    delta: FloatArray,
    groups: Sequence[str],
    seed: int,
    statuses: Sequence[str] | None = None,
    draws: int = DRAWS,
) -> list[Member]:
    """Return persons with these true log ratios (d, 3), measured at both visits."""
    both = measured_visits(delta, seed)
    weight = np.full(draws, 1.0 / draws)
    found = []
    for d, context in enumerate(case.contexts(len(delta), np.random.default_rng(seed))):
        earlier, later = (
            each.posterior(d, case.THETA_PRIOR, draws, 10_000 * seed + 2 * d + number)
            for number, each in enumerate(both)
        )
        status = statuses[d] if statuses else "not contradicted"
        recycled = (later / earlier, weight)
        found.append(make_member(context, status, groups[d], recycled, (draws, case.EXACT.interval), 1))
    return found


def infer(members: Sequence[Member], seed: int = 1) -> CohortResult:
    """Infer what has changed."""
    return infer_population(members, of_ratios(case.THETA_PRIOR, SETTINGS.hyperprior), EFFORT, None, seed)
