"""What was inferred of a cohort, in the form that is stored."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.draws import interval_levels
from swesbi.persons.cohort.cohort import weighted_quantiles
from swesbi.persons.cohort.hyperprior import in_rows
from swesbi.persons.cohort.infer import CohortResult
from swesbi.persons.cohort.result import NOTE_SEPARATOR, CohortPosterior, Population, Subjects
from swesbi.posterior.space import log_posterior_of_logit
from swesbi.prior import to_logit


def stored_form(inferred: CohortResult, notes: tuple[str, ...] = ()) -> CohortPosterior:
    """Return what is stored of the posterior of a cohort; ``notes`` are put before its own."""
    design, shrinkage, rows = inferred.design, inferred.shrinkage, in_rows(inferred.eta)[None]
    first_group = 2 + len(design.covariates)
    return CohortPosterior(
        **of_any_population(inferred, notes),
        subject=tuple(member.subject for member in inferred.members),
        covariate=design.covariates,
        design=design.matrix,
        covariate_centre=design.centres,
        population=Population(
            median=rows[:, :, 0],
            spread=rows[:, :, 1],
            covariate_factor=rows[:, :, 2:first_group],
            group_factor=rows[:, :, first_group:],
            theta=drawn_within(inferred)[None],
        ),
        subjects=Subjects(refreshed=np.array(inferred.refreshed), **of_members(inferred)),
        log_likelihood=shrinkage.log_likelihood[None],
    )


def of_any_population(inferred: CohortResult, notes: Sequence[str]) -> dict[str, Any]:
    """Return the fields that what is stored of theta and of its ratios have in common, but the members."""
    design, exact = inferred.design, inferred.exact
    log_posterior = log_posterior_of_logit(inferred.model, to_logit(inferred.eta, inferred.prior))
    return {
        "verdict": tuple(member.status for member in inferred.members),
        "group": tuple(member.group for member in inferred.members),
        "compared_group": design.groups[1:],
        "hyperparameter": inferred.prior.names,
        "first_group": design.groups[0] if design.groups else "",
        "notes": NOTE_SEPARATOR.join((*notes, *design.notes)),
        "interval_mass": inferred.interval,
        "sampler": exact.sampler,
        "reasons": NOTE_SEPARATOR.join(exact.reasons),
        "converged": exact.converged,
        "k_hat": exact.k_hat,
        "efficiency": exact.efficiency,
        "effective_draws": exact.effective_draws,
        "hyperprior": np.array([[p.centre, p.log_sd, p.low, p.high] for p in inferred.prior.parameters]),
        "log_posterior": log_posterior[None],
    }


def drawn_within(inferred: CohortResult) -> FloatArray:
    """Return draws of each member's quantity within the population; shape (m, d, 3)."""
    rows = inferred.shrinkage.rows
    drawn = [draws.theta[rows[:, d]] for d, draws in enumerate(inferred.model.recycled)]
    return np.stack(drawn, axis=1)


def of_members(inferred: CohortResult) -> dict[str, FloatArray]:
    """Return the members before and after the population is taken into account."""
    low, high = interval_levels(inferred.interval)
    levels = np.array([low, 0.5, high])
    shrinkage = inferred.shrinkage
    after = zip(inferred.model.recycled, shrinkage.weights, strict=True)
    return {
        "before": np.stack([one.alone for one in inferred.members]),
        "after": np.stack([weighted_quantiles(draws.theta, weight, levels) for draws, weight in after]),
        "effective_draws": shrinkage.effective,
        "outlier_prior": inferred.model.outlier,
        "outlier_posterior": shrinkage.outlier,
    }
