"""What was inferred of a cohort, in the form that is stored."""

from __future__ import annotations

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.draws import interval_levels
from swesbi.persons.cohort.cohort import weighted_quantiles
from swesbi.persons.cohort.hyperprior import in_rows
from swesbi.persons.cohort.infer import Inferred
from swesbi.persons.cohort.result import NOTE_SEPARATOR, CohortPosterior, Population, Subjects
from swesbi.posterior.space import log_posterior_of_logit
from swesbi.prior import to_logit


def stored_form(inferred: Inferred, notes: tuple[str, ...] = ()) -> CohortPosterior:
    """Return what is stored of the posterior of a cohort; ``notes`` are put before its own."""
    design, exact, shrunken = inferred.design, inferred.exact, inferred.shrunken
    return CohortPosterior(
        subject=tuple(member.subject for member in inferred.members),
        verdict=tuple(member.status for member in inferred.members),
        group=tuple(member.group for member in inferred.members),
        covariate=design.covariates,
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
        design=design.matrix,
        covariate_centre=design.centres,
        population=_population(inferred),
        subjects=_subjects(inferred),
        log_posterior=_log_posterior(inferred)[None],
        log_likelihood=shrunken.log_likelihood[None],
    )


def _population(inferred: Inferred) -> Population:
    rows = in_rows(inferred.eta)[None]
    first_group = 2 + len(inferred.design.covariates)
    drawn = inferred.shrunken.rows
    theta = [draws.theta[drawn[:, d]] for d, draws in enumerate(inferred.model.recycled)]
    return Population(
        median=rows[:, :, 0],
        spread=rows[:, :, 1],
        covariate_factor=rows[:, :, 2:first_group],
        group_factor=rows[:, :, first_group:],
        theta=np.stack(theta, axis=1)[None],
    )


def _subjects(inferred: Inferred) -> Subjects:
    low, high = interval_levels(inferred.interval)
    levels = np.array([low, 0.5, high])
    shrunken = inferred.shrunken
    after = zip(inferred.model.recycled, shrunken.weights, strict=True)
    return Subjects(
        before=np.stack([one.alone for one in inferred.members]),
        after=np.stack([weighted_quantiles(draws.theta, weight, levels) for draws, weight in after]),
        effective_draws=shrunken.effective,
        refreshed=np.array(inferred.refreshed),
        outlier_prior=inferred.model.outlier,
        outlier_posterior=shrunken.outlier,
    )


def _log_posterior(inferred: Inferred) -> FloatArray:
    return log_posterior_of_logit(inferred.model, to_logit(inferred.eta, inferred.prior))
