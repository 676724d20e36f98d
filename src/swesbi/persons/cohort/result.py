"""``cohort_posterior.h5``: the posterior of a population and of its subjects within it, in ArviZ's layout.

Read without the libraries that made it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import Artefact, Group, Labels, Part, Variable, to_groups
from swesbi.base.arrays import FloatArray
from swesbi.parameters import THETA_COLUMNS, THETA_NAMES

NOTE_SEPARATOR: Final = " | "


@dataclass(frozen=True)
class Population:
    """Draws of what the population is like; the first axis is ArviZ's only chain.

    Factors of covariates are per ten years, male over female, per ten beats per minute; those of groups
    are against the first group.
    """

    median: Annotated[
        FloatArray,
        Variable("chain draw parameter", THETA_COLUMNS, "population median at the cohort's mean covariates"),
    ]
    spread: Annotated[
        FloatArray, Variable("chain draw parameter", "1", "standard deviation of log theta between subjects")
    ]
    covariate_factor: Annotated[
        FloatArray,
        Variable("chain draw covariate parameter", "1", "factor of a parameter per covariate step"),
    ]
    group_factor: Annotated[
        FloatArray, Variable("chain draw compared_group parameter", "1", "factor against the first group")
    ]
    theta: Annotated[
        FloatArray,
        Variable("chain draw subject parameter", THETA_COLUMNS, "theta of each subject in the population"),
    ]


@dataclass(frozen=True)
class Subjects:
    """The subjects before and after the population is taken into account."""

    before: Annotated[
        FloatArray,
        Variable("subject limit parameter", THETA_COLUMNS, "lower limit, median, upper limit of each alone"),
    ]
    after: Annotated[
        FloatArray,
        Variable("subject limit parameter", THETA_COLUMNS, "the same within the population"),
    ]
    effective_draws: Annotated[
        FloatArray,
        Variable("subject", "1", "effective number of recycled draws, averaged over the population"),
    ]
    refreshed: Annotated[NDArray[np.int_], Variable("subject", "1", "how often drawn anew")]
    outlier_prior: Annotated[
        FloatArray, Variable("subject", "1", "prior probability, by verdict, to be none of the population")
    ]
    outlier_posterior: Annotated[
        FloatArray, Variable("subject", "1", "posterior probability to be none of the population")
    ]


@dataclass(frozen=True)
class StoredPopulation(Artefact):
    """What is stored of any population's posterior: what is compared, and how the draws were obtained.

    Attributes:
        compared_group: Groups but the first, where groups are compared.
        first_group: The first of them; empty where they are not compared.
    """

    compared_group: Annotated[tuple[str, ...], Labels("compared_group")]
    hyperparameter: Annotated[tuple[str, ...], Labels("hyperparameter")]
    first_group: Annotated[str, Variable("", "1", "group that the others are compared with; or empty")]
    interval_mass: Annotated[float, Variable("", "1", "mass of the credible intervals")]
    sampler: Annotated[str, Variable("", "1", "what gave the draws: importance or mcmc")]
    reasons: Annotated[str, Variable("", "1", "why the weights were not used, what the sampler missed")]
    converged: Annotated[bool, Variable("", "1", "1 where weights or sampler are reliable, else 0")]
    k_hat: Annotated[float, Variable("", "1", "Pareto shape of the importance weights")]
    efficiency: Annotated[float, Variable("", "1", "effective share of the weighted draws")]
    effective_draws: Annotated[
        FloatArray, Variable("hyperparameter", "1", "effective number behind the draws")
    ]
    log_posterior: Annotated[
        FloatArray,
        Variable("chain draw", "1", "log density, not normalised, of the logit", "lp", "sample_stats"),
    ]

    labels = {
        "parameter": list(THETA_NAMES),
        "limit": ["lower", "median", "upper"],
        "law": ["centre", "log_sd", "low", "high"],
    }

    @property
    def groups(self) -> tuple[str, ...]:
        """The groups that are compared, the first one first; empty where none are."""
        return (self.first_group, *self.compared_group) if self.compared_group else ()

    def to_groups(self) -> dict[str, Group]:
        """Return the groups of the file, with ArviZ's numbers of the only chain and of the draws."""
        return to_groups(self, {**self.labels, "chain": [0], "draw": np.arange(self.log_posterior.shape[1])})


@dataclass(frozen=True)
class CohortPosterior(StoredPopulation, kind="cohort_posterior"):
    """The posterior of a cohort as it is stored.

    Attributes:
        subject: Names of the d subjects, with their verdicts and groups.
        covariate: Names of the covariates that vary; ``group`` of each subject may be empty.
        notes: What was left out, a sentence each, joined.
    """

    subject: Annotated[tuple[str, ...], Labels("subject")]
    verdict: Annotated[tuple[str, ...], Labels("subject", "verdict")]
    group: Annotated[tuple[str, ...], Labels("subject", "group")]
    covariate: Annotated[tuple[str, ...], Labels("covariate")]
    notes: Annotated[str, Variable("", "1", "what was left out, and why; or empty")]
    hyperprior: Annotated[
        FloatArray,
        Variable("hyperparameter law", "unit of the hyperparameter", "centre, log sd, lower, upper bound"),
    ]
    design: Annotated[
        FloatArray, Variable("subject term", "1", "centred covariates and groups", group="constant_data")
    ]
    covariate_centre: Annotated[
        FloatArray,
        Variable(
            "covariate", "years, 1, 1/min", "mean, men counting 1/2 and women -1/2", group="constant_data"
        ),
    ]
    population: Annotated[Population, Part(group="posterior")]
    subjects: Annotated[Subjects, Part(group="subjects")]
    log_likelihood: Annotated[
        FloatArray,
        Variable(
            "chain draw subject", "1", "log evidence ratio of each recording", "recording", "log_likelihood"
        ),
    ]
