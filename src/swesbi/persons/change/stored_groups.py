"""``changes_groups.h5``: what has changed in groups, and in each person within them, in ArviZ's layout."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import pandas as pd
import xarray as xr

from swesbi.artefacts import (
    Labels,
    Part,
    Variable,
    from_groups,
    labels_of,
    load,
    register,
    schema_of,
    to_groups,
)
from swesbi.base.arrays import FloatArray
from swesbi.draws import interval_levels, median_and_interval
from swesbi.parameters import THETA_NAMES
from swesbi.persons.change.groups import log_change
from swesbi.persons.cohort.cohort import weighted_quantiles
from swesbi.persons.cohort.hyperprior import in_rows
from swesbi.persons.cohort.infer import Inferred
from swesbi.posterior.space import log_posterior_of_logit
from swesbi.prior import to_logit

NOTE_SEPARATOR: Final = " | "
RATIO, SPREAD, DIFFERENCE = "mean ratio", "spread between persons", "ratio of groups"
EVERYONE: Final = "all"
COLUMNS: Final = (
    "quantity", "of", "persons", "parameter", "median_1", "low_1", "high_1", "probability_above_1",
)  # fmt: skip
PERSON_COLUMNS: Final = (
    "person", "verdict", "group", "parameter", "alone_median_1", "alone_low_1", "alone_high_1", "median_1",
    "low_1", "high_1", "effective_draws", "outlier_probability",
)  # fmt: skip


@dataclass(frozen=True)
class GroupDraws:
    """Draws of what has changed in the population; the first axis is ArviZ's only chain."""

    ratio: Annotated[
        FloatArray,
        Variable(
            "chain draw parameter",
            "1",
            "later over earlier, geometric mean of all persons or of the first group",
        ),
    ]
    spread: Annotated[
        FloatArray,
        Variable("chain draw parameter", "1", "standard deviation of the log ratio between persons"),
    ]
    group_factor: Annotated[
        FloatArray,
        Variable("chain draw compared_group parameter", "1", "a group's ratio over that of the first group"),
    ]
    person_ratio: Annotated[
        FloatArray,
        Variable("chain draw person parameter", "1", "ratio of each person within the population"),
    ]


@dataclass(frozen=True)
class PersonRatios:
    """The persons before and after the population is taken into account."""

    before: Annotated[
        FloatArray,
        Variable("person limit parameter", "1", "lower limit, median, upper limit of each ratio alone"),
    ]
    after: Annotated[FloatArray, Variable("person limit parameter", "1", "the same within the population")]
    effective_draws: Annotated[
        FloatArray,
        Variable("person", "1", "effective number of recycled draws, averaged over the population"),
    ]
    outlier_prior: Annotated[
        FloatArray, Variable("person", "1", "prior probability, by verdict, to be none of the population")
    ]
    outlier_posterior: Annotated[
        FloatArray, Variable("person", "1", "posterior probability to be none of the population")
    ]


@dataclass(frozen=True)
class ChangeGroups:
    """What has changed in groups, as it is stored.

    Attributes:
        person: Names of the d persons, with the verdicts on their pairs and their groups, which may be empty.
        compared_group: Groups but the first, where groups are compared.
        hyperparameter: Names of the hyperparameters.
        first_group: The first of them; empty where they are not compared.
        notes: Who is left out and why, what is not compared, whose draws are few: a sentence each, joined.
    """

    person: Annotated[tuple[str, ...], Labels("person")]
    verdict: Annotated[tuple[str, ...], Labels("person", "verdict")]
    group: Annotated[tuple[str, ...], Labels("person", "group")]
    compared_group: Annotated[tuple[str, ...], Labels("compared_group")]
    hyperparameter: Annotated[tuple[str, ...], Labels("hyperparameter")]
    first_group: Annotated[str, Variable("", "1", "group that the others are compared with; or empty")]
    notes: Annotated[str, Variable("", "1", "who and what was left out, and why; or empty")]
    interval_mass: Annotated[float, Variable("", "1", "mass of the credible intervals")]
    sampler: Annotated[str, Variable("", "1", "what gave the draws: importance or mcmc")]
    reasons: Annotated[str, Variable("", "1", "why the weights were not used, what the sampler missed")]
    converged: Annotated[bool, Variable("", "1", "1 where weights or sampler are reliable, else 0")]
    k_hat: Annotated[float, Variable("", "1", "Pareto shape of the importance weights")]
    efficiency: Annotated[float, Variable("", "1", "effective share of the weighted draws")]
    effective_draws: Annotated[
        FloatArray, Variable("hyperparameter", "1", "effective number behind the draws")
    ]
    hyperprior: Annotated[
        FloatArray, Variable("hyperparameter law", "1", "centre, log sd, lower, upper bound")
    ]
    population: Annotated[GroupDraws, Part(group="posterior")]
    persons: Annotated[PersonRatios, Part(group="persons")]
    log_posterior: Annotated[
        FloatArray,
        Variable("chain draw", "1", "log density, not normalised, of the logit", "lp", "sample_stats"),
    ]
    log_likelihood: Annotated[
        FloatArray,
        Variable(
            "chain draw person",
            "1",
            "log evidence ratio of each pair of recordings",
            "recording",
            "log_likelihood",
        ),
    ]

    @property
    def groups(self) -> tuple[str, ...]:
        """The groups that are compared, the first one first; empty where none are."""
        return (self.first_group, *self.compared_group) if self.compared_group else ()

    def ratio_of(self, group: int) -> FloatArray:
        """Return draws (m, 3) of the mean ratio of a group; of all persons (0) where none are compared."""
        ratio = self.population.ratio[0]
        return ratio if group == 0 else np.asarray(ratio * self.population.group_factor[0, :, group - 1])


SCHEMA: Final = schema_of(ChangeGroups)
KIND: Final = register("change_groups", SCHEMA, ("parameter", *labels_of(ChangeGroups)))


def stored_groups(inferred: Inferred, notes: Sequence[str]) -> ChangeGroups:
    """Return what is stored of the change in groups; ``notes`` are put before those of its design."""
    design, exact, shrunken, members = inferred.design, inferred.exact, inferred.shrunken, inferred.members
    rows = in_rows(inferred.eta)[None]
    return ChangeGroups(
        person=tuple(member.subject for member in members),
        verdict=tuple(member.status for member in members),
        group=tuple(member.group for member in members),
        compared_group=design.groups[1:],
        hyperparameter=inferred.prior.names,
        first_group=design.groups[0] if design.groups else "",
        notes=NOTE_SEPARATOR.join((*notes, *design.notes)),
        interval_mass=inferred.interval,
        sampler=exact.sampler,
        reasons=NOTE_SEPARATOR.join(exact.reasons),
        converged=exact.converged,
        k_hat=exact.k_hat,
        efficiency=exact.efficiency,
        effective_draws=exact.effective_draws,
        hyperprior=np.array([[p.centre, p.log_sd, p.low, p.high] for p in inferred.prior.parameters]),
        population=GroupDraws(rows[:, :, 0], rows[:, :, 1], rows[:, :, 2:], log_change(inferred)[None]),
        persons=_persons(inferred),
        log_posterior=log_posterior_of_logit(inferred.model, to_logit(inferred.eta, inferred.prior))[None],
        log_likelihood=shrunken.log_likelihood[None],
    )


def _persons(inferred: Inferred) -> PersonRatios:
    low, high = interval_levels(inferred.interval)
    levels = np.array([low, 0.5, high])
    shrunken = inferred.shrunken
    after = zip(inferred.model.recycled, shrunken.weights, strict=True)
    return PersonRatios(
        before=np.stack([one.alone for one in inferred.members]),
        after=np.stack([weighted_quantiles(draws.theta, weight, levels) for draws, weight in after]),
        effective_draws=shrunken.effective,
        outlier_prior=inferred.model.outlier,
        outlier_posterior=shrunken.outlier,
    )


def change_groups_datasets(stored: ChangeGroups) -> dict[str, xr.Dataset]:
    """Return the groups of ``changes_groups.h5``."""
    labels = {
        "parameter": list(THETA_NAMES),
        "chain": [0],
        "draw": np.arange(stored.log_posterior.shape[1]),
        "limit": ["lower", "median", "upper"],
        "law": ["centre", "log_sd", "low", "high"],
    }
    return to_groups(stored, labels)


def read_change_groups(path: Path) -> ChangeGroups:
    """Read ``changes_groups.h5``.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    return from_groups(ChangeGroups, {group: load(path, KIND, group)[0] for group in SCHEMA})


def change_groups_table(stored: ChangeGroups) -> pd.DataFrame:
    """Return a row for the mean ratio of each group, the spread and each ratio of groups, by parameter."""
    return pd.DataFrame(_rows(stored), columns=list(COLUMNS))


def _rows(stored: ChangeGroups) -> Iterator[dict[str, Any]]:
    names, population = stored.groups or (EVERYONE,), stored.population
    for j, parameter in enumerate(THETA_NAMES):
        for number, name in enumerate(names):
            persons = sum(name in (EVERYONE, group) for group in stored.group)
            yield _row(stored, (RATIO, name, parameter), stored.ratio_of(number)[:, j], persons)
        yield _row(stored, (SPREAD, EVERYONE, parameter), population.spread[0, :, j], len(stored.person))
        for number, name in enumerate(stored.compared_group):
            draws = population.group_factor[0, :, number, j]
            of = (DIFFERENCE, f"{name} over {stored.first_group}", parameter)
            yield _row(stored, of, draws, sum(group in (name, stored.first_group) for group in stored.group))


def _row(stored: ChangeGroups, of: tuple[str, str, str], draws: FloatArray, persons: int) -> dict[str, Any]:
    low, median, high = median_and_interval(draws, stored.interval_mass)
    quantity, name, parameter = of
    row = {"quantity": quantity, "of": name, "persons": persons, "parameter": parameter}
    row |= {"median_1": median, "low_1": low, "high_1": high}
    return row if quantity == SPREAD else row | {"probability_above_1": float((draws > 1.0).mean())}


def change_persons_table(stored: ChangeGroups) -> pd.DataFrame:
    """Return a row a person and parameter: the ratio alone, and within the population."""
    persons = stored.persons
    rows = [
        {
            "person": name,
            "verdict": stored.verdict[d],
            "group": stored.group[d],
            "parameter": parameter,
            **_limits("alone_", persons.before[d, :, j]),
            **_limits("", persons.after[d, :, j]),
            "effective_draws": persons.effective_draws[d],
            "outlier_probability": persons.outlier_posterior[d],
        }
        for d, name in enumerate(stored.person)
        for j, parameter in enumerate(THETA_NAMES)
    ]
    return pd.DataFrame(rows, columns=list(PERSON_COLUMNS))


def _limits(prefix: str, limits: FloatArray) -> dict[str, float]:
    return {f"{prefix}{name}_1": float(limits[i]) for i, name in enumerate(("low", "median", "high"))}
