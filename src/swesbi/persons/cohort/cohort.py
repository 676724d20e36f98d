"""The subjects of a cohort as its posterior sees them: recycled draws, covariates, group, verdict."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.draws import interval_levels, resampled_rows
from swesbi.parameters import THETA_NAMES, ParameterPrior
from swesbi.persons.settings import HyperpriorSettings, RatioHyperpriorSettings
from swesbi.seeds import generator

AGE, SEX, HEART_RATE = "age", "sex", "heart_rate"
COVARIATES: Final = (AGE, SEX, HEART_RATE)
YEARS: Final = 10.0
BEATS_PER_MINUTE: Final = 10.0
"""Steps of age and heart rate that a slope is a factor per."""


@dataclass(frozen=True)
class Member:
    """One subject of the cohort: those equally weighted draws of its posterior, (n, 3), that are recycled.

    ``alone`` has lower limit, median and upper limit of its whole posterior, (3, 3), a column a parameter.
    """

    context: Context
    status: str
    group: str
    theta: FloatArray
    alone: FloatArray

    @property
    def subject(self) -> str:
        """Its name."""
        return self.context.subject


def make_member(
    context: Context,
    status: str,
    group: str,
    draws: tuple[FloatArray, FloatArray],
    sizes: tuple[int, float],
    seed: int,
) -> Member:
    """Return a subject with those draws that are recycled, the same whoever else is in the cohort.

    ``draws`` are theta (n, 3) and weights (n,); ``sizes`` how many are recycled, and the interval's mass.
    """
    theta, weight = draws
    count, mass = sizes
    rng = generator(seed, "cohort posterior", "thinning", context.subject)
    return Member(
        context,
        status,
        group,
        theta=np.asarray(theta[resampled_rows(weight, count, rng)]),
        alone=weighted_quantiles(theta, weight, np.insert(interval_levels(mass), 1, 0.5)),
    )


def weighted_quantiles(values: FloatArray, weight: FloatArray, levels: FloatArray) -> FloatArray:
    """Return quantiles (levels, 3) of weighted draws (n, 3), interpolated between the draws' midpoints."""
    columns = []
    for column in values.T:
        order = np.argsort(column, kind="stable")
        passed = np.cumsum(weight[order])
        columns.append(np.interp(levels * passed[-1], passed - 0.5 * weight[order], column[order]))
    return np.stack(columns, axis=1)


@dataclass(frozen=True)
class Design:
    """What log theta depends on: covariates that vary over the cohort, and groups, compared with the first.

    Centres are years, share of men less a half, beats per minute. The matrix has a row a subject: centred
    covariates, then one column for each further group. Notes say what was left out, and why.
    """

    covariates: tuple[str, ...]
    centres: FloatArray
    groups: tuple[str, ...]
    matrix: FloatArray
    notes: tuple[str, ...]


def design_of(
    members: Sequence[Member], covariates: Sequence[str] = COVARIATES, reference: str = ""
) -> Design:
    """Return the design of a cohort; what it cannot tell is left out, with a note.

    Age counts by ten years, heart rate by ten beats per minute, a man as +1/2 and a woman as -1/2; each is
    centred on the cohort's mean. Groups are in the order of the subjects, the reference first (empty:
    theirs).
    """
    raw = np.array([_covariates(member.context) for member in members])
    centres = raw.mean(axis=0)
    asked = np.array([name in covariates for name in COVARIATES])
    varies = (np.ptp(raw, axis=0) > 0.0) & asked
    groups, refused = _groups(members, reference)
    of_group = [[float(member.group == group) for member in members] for group in groups[1:]]
    notes = [
        f"{name.replace('_', ' ')} does not vary over the cohort: no slope on it is inferred"
        for name, vary in zip(COVARIATES, varies | ~asked, strict=True)
        if not vary
    ]
    steps = np.array([YEARS, 1.0, BEATS_PER_MINUTE])
    return Design(
        covariates=tuple(name for name, vary in zip(COVARIATES, varies, strict=True) if vary),
        centres=(centres * steps)[varies],
        groups=groups,
        matrix=np.column_stack([(raw - centres)[:, varies], *of_group]),
        notes=(*notes, *refused),
    )


def _covariates(context: Context) -> list[float]:
    sex = 0.5 if context.sex == "M" else -0.5
    return [context.age_years / YEARS, sex, context.hr_bpm / BEATS_PER_MINUTE]


def _groups(members: Sequence[Member], reference: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the groups that can be compared, the reference first, and why they are not where they cannot."""
    sizes = Counter(member.group for member in members)
    first = [reference_among(list(sizes), reference)] if reference else []
    if len(sizes) < 2:
        return (), ()
    if "" in sizes:
        without = [member.subject for member in members if not member.group]
        return (), (
            f"groups are not compared: {', '.join(without)} {'has' if len(without) == 1 else 'have'} none; "
            "fill the column group of subjects.csv for every subject",
        )
    if single := [group for group, size in sizes.items() if size == 1]:
        return (), (
            f"groups are not compared: the group {single[0]!r} has one person, whose difference from the "
            "others says nothing of a group; everyone is taken as one population",
        )
    return tuple(dict.fromkeys([*first, *sizes])), ()


def reference_among(groups: Sequence[str], reference: str) -> str:
    """Return the reference group; raise ValueError that names the groups where it is none of them."""
    if reference not in groups:
        named = ", ".join(filter(None, dict.fromkeys(groups))) or "none"
        raise ValueError(f"reference group {reference!r}: no person is of it; the groups are {named}")
    return reference


@dataclass(frozen=True)
class Hyperprior:
    """Independent priors of the hyperparameters eta, three in a row, a row after another.

    Rows are the population's median of each parameter, its spread (standard deviation of its logarithm), then
    one for each column of the design: the factor of each parameter per step.
    """

    rows: tuple[str, ...]
    parameters: tuple[ParameterPrior, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the 3 r hyperparameters."""
        return tuple(f"{row} {parameter}" for row in self.rows for parameter in THETA_NAMES)


def hyperprior_of(
    design: Design,
    median: Sequence[ParameterPrior],
    settings: HyperpriorSettings | RatioHyperpriorSettings,
) -> Hyperprior:
    """Return the hyperprior of a population of this design, with these priors of the three medians."""
    of_covariates = [(name, getattr(settings, f"{name}_factor")) for name in design.covariates]
    factors = of_covariates + [(group, settings.group_factor) for group in design.groups[1:]]
    alike = [("spread", settings.spread), *((f"{name} factor", prior) for name, prior in factors)]
    return Hyperprior(
        rows=("median", *(name for name, _ in alike)),
        parameters=(*median, *(prior for _, prior in alike for _ in THETA_NAMES)),
    )


def in_rows(eta: FloatArray) -> FloatArray:
    """Return eta (..., 3 r) as (..., r, 3): a row a kind of hyperparameter, a column a parameter."""
    return np.reshape(eta, (*eta.shape[:-1], -1, len(THETA_NAMES)))
