"""The posterior of a population and of its members, as it is stored: in ArviZ's layout, read without arviz.

A population is one of hearts, whose members are subjects with theta, or one of changes, whose members are
persons with the ratio of theta at two visits. ``cohort_posterior.h5`` has the one, ``changes_groups.h5`` the
other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import Artefact, Group, Labels, Part, Variable, to_groups
from swesbi.base.arrays import FloatArray
from swesbi.draws import interval_levels
from swesbi.parameters import THETA_NAMES
from swesbi.persons.cohort.cohort import weighted_quantiles
from swesbi.persons.cohort.hyperprior import in_rows
from swesbi.persons.cohort.infer import CohortResult
from swesbi.posterior.space import log_posterior_of_logit
from swesbi.prior import to_logit

NOTE_SEPARATOR: Final = " | "
AS_UNIT: Final = "as unit says"


@dataclass(frozen=True)
class Population:
    """Draws of what the population is like; the first axis is ArviZ's only chain.

    Factors of covariates are per ten years, male over female, per ten beats per minute; those of groups
    are against the reference group.
    """

    median: Annotated[
        FloatArray,
        Variable(
            "chain draw parameter", AS_UNIT, "median, of the reference group, at the mean of the covariates"
        ),
    ]
    spread: Annotated[
        FloatArray,
        Variable("chain draw parameter", "1", "standard deviation of the logarithm between members"),
    ]
    covariate_factor: Annotated[
        FloatArray,
        Variable("chain draw covariate parameter", "1", "factor of a parameter per covariate step"),
    ]
    group_factor: Annotated[
        FloatArray, Variable("chain draw compared_group parameter", "1", "factor against the reference group")
    ]
    within: Annotated[
        FloatArray, Variable("chain draw member parameter", AS_UNIT, "each member within the population")
    ]


@dataclass(frozen=True)
class Members:
    """The members before and after the population is taken into account."""

    before: Annotated[
        FloatArray,
        Variable("member limit parameter", AS_UNIT, "lower limit, median, upper limit of each alone"),
    ]
    after: Annotated[
        FloatArray, Variable("member limit parameter", AS_UNIT, "the same within the population")
    ]
    effective_draws: Annotated[
        FloatArray,
        Variable("member", "1", "effective number of recycled draws, averaged over the population"),
    ]
    refreshed: Annotated[NDArray[np.int_], Variable("member", "1", "how often drawn anew")]
    outlier_prior: Annotated[
        FloatArray, Variable("member", "1", "prior probability, by verdict, to be none of the population")
    ]
    outlier_posterior: Annotated[
        FloatArray, Variable("member", "1", "posterior probability to be none of the population")
    ]


@dataclass(frozen=True)
class CohortPosterior(Artefact, kind="cohort_posterior"):
    """What is stored of the posterior of a population.

    Attributes:
        member: Names of the d members, with their verdicts and groups, which may be empty.
        unit: Of each parameter: of theta, or of ratios.
        covariate: Names of the covariates that vary.
        compared_group: Groups but the reference, where groups are compared.
        reference_group: That with which they are compared; empty where they are not.
        notes: What and who was left out, a sentence each, joined.
    """

    member: Annotated[tuple[str, ...], Labels("member")]
    verdict: Annotated[tuple[str, ...], Labels("member", "verdict")]
    group: Annotated[tuple[str, ...], Labels("member", "group")]
    unit: Annotated[tuple[str, ...], Labels("parameter", "unit")]
    covariate: Annotated[tuple[str, ...], Labels("covariate")]
    compared_group: Annotated[tuple[str, ...], Labels("compared_group")]
    hyperparameter: Annotated[tuple[str, ...], Labels("hyperparameter")]
    reference_group: Annotated[str, Variable("", "1", "group that the others are compared with; or empty")]
    interval_mass: Annotated[float, Variable("", "1", "mass of the credible intervals")]
    sampler: Annotated[str, Variable("", "1", "what gave the draws: importance or mcmc")]
    reasons: Annotated[str, Variable("", "1", "why the weights were not used, what the sampler missed")]
    converged: Annotated[bool, Variable("", "1", "1 where weights or sampler are reliable, else 0")]
    k_hat: Annotated[float, Variable("", "1", "Pareto shape of the importance weights")]
    efficiency: Annotated[float, Variable("", "1", "effective share of the weighted draws")]
    effective_draws: Annotated[
        FloatArray, Variable("hyperparameter", "1", "effective number behind the draws")
    ]
    notes: Annotated[str, Variable("", "1", "what and who was left out, and why; or empty")]
    hyperprior: Annotated[
        FloatArray,
        Variable("hyperparameter law", "unit of the hyperparameter", "centre, log sd, lower, upper bound"),
    ]
    log_posterior: Annotated[
        FloatArray,
        Variable("chain draw", "1", "log density, not normalised, of the logit", "lp", "sample_stats"),
    ]
    design: Annotated[
        FloatArray, Variable("member term", "1", "centred covariates and groups", group="constant_data")
    ]
    covariate_centre: Annotated[
        FloatArray,
        Variable(
            "covariate", "years, 1, 1/min", "mean, men counting 1/2 and women -1/2", group="constant_data"
        ),
    ]
    population: Annotated[Population, Part(group="posterior")]
    members: Annotated[Members, Part(group="members")]
    log_likelihood: Annotated[
        FloatArray,
        Variable(
            "chain draw member", "1", "log evidence ratio of each recording", "recording", "log_likelihood"
        ),
    ]

    labels = {
        "parameter": list(THETA_NAMES),
        "limit": ["lower", "median", "upper"],
        "law": ["centre", "log_sd", "low", "high"],
    }

    @property
    def groups(self) -> tuple[str, ...]:
        """The groups that are compared, the reference first; empty where none are."""
        return (self.reference_group, *self.compared_group) if self.compared_group else ()

    def median_of(self, group: int) -> FloatArray:
        """Return draws (m, 3) of the median of a group, by its place in ``groups``; of everyone: 0."""
        median = self.population.median[0]
        return median if group == 0 else np.asarray(median * self.population.group_factor[0, :, group - 1])

    def to_groups(self) -> dict[str, Group]:
        """Return the groups of the file, with ArviZ's numbers of the only chain and of the draws."""
        return to_groups(self, {**self.labels, "chain": [0], "draw": np.arange(self.log_posterior.shape[1])})


def stored_form(inferred: CohortResult, notes: Sequence[str] = ()) -> CohortPosterior:
    """Return what is stored of the posterior of a population; ``notes`` are put before its own."""
    design, exact, prior = inferred.design, inferred.exact, inferred.prior
    rows = in_rows(inferred.eta)[None]
    first_group = 2 + len(design.covariates)
    log_posterior = log_posterior_of_logit(inferred.model, to_logit(inferred.eta, prior))
    return CohortPosterior(
        member=tuple(member.subject for member in inferred.members),
        verdict=tuple(member.status for member in inferred.members),
        group=tuple(member.group for member in inferred.members),
        unit=inferred.quantity.units,
        covariate=design.covariates,
        compared_group=design.groups[1:],
        hyperparameter=prior.names,
        reference_group=design.groups[0] if design.groups else "",
        interval_mass=inferred.interval,
        sampler=exact.sampler,
        reasons=NOTE_SEPARATOR.join(exact.reasons),
        converged=exact.converged,
        k_hat=exact.k_hat,
        efficiency=exact.efficiency,
        effective_draws=exact.effective_draws,
        notes=NOTE_SEPARATOR.join((*notes, *design.notes)),
        hyperprior=np.array([[each.centre, each.log_sd, each.low, each.high] for each in prior.parameters]),
        log_posterior=log_posterior[None],
        design=design.matrix,
        covariate_centre=design.centres,
        population=Population(
            median=rows[:, :, 0],
            spread=rows[:, :, 1],
            covariate_factor=rows[:, :, 2:first_group],
            group_factor=rows[:, :, first_group:],
            within=_drawn_within(inferred)[None],
        ),
        members=_members(inferred),
        log_likelihood=inferred.shrinkage.log_likelihood[None],
    )


def _drawn_within(inferred: CohortResult) -> FloatArray:
    """Return draws of each member's quantity within the population; shape (m, d, 3)."""
    rows = inferred.shrinkage.rows
    drawn = [draws.theta[rows[:, d]] for d, draws in enumerate(inferred.model.recycled)]
    return np.stack(drawn, axis=1)


def _members(inferred: CohortResult) -> Members:
    low, high = interval_levels(inferred.interval)
    levels = np.array([low, 0.5, high])
    shrinkage = inferred.shrinkage
    after = zip(inferred.model.recycled, shrinkage.weights, strict=True)
    return Members(
        before=np.stack([one.alone for one in inferred.members]),
        after=np.stack([weighted_quantiles(draws.theta, weight, levels) for draws, weight in after]),
        effective_draws=shrinkage.effective,
        refreshed=np.array(inferred.refreshed),
        outlier_prior=inferred.model.outlier,
        outlier_posterior=shrinkage.outlier,
    )
