"""Persons who came twice, without hearts: log theta of each visit is measured with normal errors.

The posterior of both visits alone is then two truncated normals. What truly changed is normal between the
persons of a group, and the earlier visit has the prior given the change, by rejection from the prior.
"""

from __future__ import annotations

from collections.abc import Sequence

import hierarchy_case as case
import numpy as np
import speed_case

from swesbi.base.arrays import FloatArray
from swesbi.persons.cohort.cohort import Member, make_member
from swesbi.persons.cohort.infer import CohortResult, infer_population, of_ratios

ERROR_SD = np.array([0.06, 0.15, 0.12])
"""Of log theta at one visit: about what a person's visits leave when much of what is not known is shared."""
DRAWS = 1000
EFFORT = case.SETTINGS.model_copy(
    update={
        "exact": case.EXACT.model_copy(
            update={"effective_draws": 600, "min_effective_draws": 200, "draws": 1000}
        )
    }
)
"""Sizes of the posterior; a study's are larger."""
SETTINGS = speed_case.shipped().change_groups.model_copy(update={"draws": DRAWS})


def true_ratios(mean: FloatArray, spread: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Draw the log ratio of each person, (d, 3), about the means (d, 3) of their groups."""
    return np.asarray(mean + spread * rng.standard_normal(mean.shape))


def visits(delta: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Draw log theta (d, 3) of both visits from the prior of both, given their differences (d, 3)."""
    centre, sd, low, high = case.law_of(case.THETA_PRIOR)
    # the product of both normal densities is normal about the middle, of sd / sqrt(2)
    least, most = np.maximum(low, low - delta), np.minimum(high, high - delta)
    earlier = case.truncated(centre - 0.5 * delta, sd / np.sqrt(2.0) + 0.0 * delta, least, most, rng)
    return earlier, earlier + delta


def measured_visits(delta: FloatArray, seed: int) -> tuple[case.Measured, case.Measured]:
    """Measure both visits of persons with these true log ratios (d, 3)."""
    rng = np.random.default_rng(seed)
    earlier, later = (
        with_errors(log_theta, rng.standard_normal(delta.shape)) for log_theta in visits(delta, rng)
    )
    return earlier, later


def with_errors(log_theta: FloatArray, errors: FloatArray, error_sd: FloatArray = ERROR_SD) -> case.Measured:
    """Measure log theta (d, 3) with errors (d, 3) in standard deviations."""
    return case.Measured(log_theta + error_sd * errors, error_sd + 0.0 * log_theta)


def ratio_draws(
    visits: Sequence[case.Measured], person: int, draws: int, seeds: tuple[int, int]
) -> FloatArray:
    """Return draws (draws, 3) of the ratio of a person's two visits."""
    earlier, later = (
        each.posterior(person, case.THETA_PRIOR, draws, seed)
        for each, seed in zip(visits, seeds, strict=True)
    )
    return np.asarray(later / earlier)


def members_of(delta: FloatArray, groups: Sequence[str], seed: int, draws: int = DRAWS) -> list[Member]:
    """Return persons with these true log ratios (d, 3), measured at both visits."""
    both = measured_visits(delta, seed)
    weight, sizes = np.full(draws, 1.0 / draws), (draws, case.EXACT.interval)
    streams = 10_000 * seed + 2 * np.arange(len(delta))
    ratios = [ratio_draws(both, d, draws, (one, one + 1)) for d, one in enumerate(streams.tolist())]
    contexts = case.contexts(len(delta), np.random.default_rng(seed))
    return [
        make_member(context, "not contradicted", group, (ratio, weight), sizes, 1)
        for context, group, ratio in zip(contexts, groups, ratios, strict=True)
    ]


def infer(members: Sequence[Member], seed: int = 1) -> CohortResult:
    """Infer what has changed."""
    return infer_population(members, of_ratios(case.THETA_PRIOR, SETTINGS.hyperprior), EFFORT, None, seed)
