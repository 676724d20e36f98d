"""The joint posterior of two visits, whether they are of one person, and all that is reported of them.

Its proposal is made in the space of both visits' networks, in which the posterior of both is near normal.
A flow takes the posterior of one recording to about N(0, I), whatever its shape. In the product of the
spaces of both, u = (u_1, u_2), the posterior of both is the product of their own posteriors, each near
N(m_v, C_v), times what ties them: the copula of the shared parameters, whose logarithm is -1/2 z^T (R^-1
- I) z in their scores z, and the ratio of the normal density of all errors r to those of each visit,
which is of the same form. Scores and residuals y are about a + B u (a regression over draws), so with G
the matrix of both forms the posterior of both has the precision and the linear term

    P = blockdiag(C_v^-1) + B^T H B,    h = (C_v^-1 m_v)_v - B^T H a,    H = G (I + S G)^-1,

S being the covariance of what the regression leaves over: what measures the hearts is integrated out.

Can two recordings be of one person? What they share is compared with what two visits of one would. In normal
scores a recording's own posterior has mean m and covariance C under the prior N(0, I), and where all is
normal m is by itself N(0, I - C). Of two visits of one person the means have the covariance

    cov(m_1, m_2) = (I - C_1) diag(rho) (I - C_2),

of two persons none. The log ratio of the two densities of (m_1, m_2) is the most powerful test of one person
against two (Neyman and Pearson 1933). It is the normal approximation of the log Bayes factor
log Z_12 - log Z_1 - log Z_2, which is reported beside it. Its null distribution is drawn: pairs of one person
with these C and shares; the level is the share of them that the test takes for two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.linalg import block_diag

from swesbi.base.arrays import FloatArray
from swesbi.draws import equal_weights
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.shared_error import normal_log_density
from swesbi.persons.change.stored import (
    QUANTITIES,
    SEPARATOR,
    OnePerson,
    Ratios,
    StoredChange,
    log_ratios,
    quantities_of,
    summarise_ratios,
)
from swesbi.persons.change.visits import Coupling, VisitsModel, visits_model
from swesbi.persons.settings import ChangeSettings
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.fitted import RIDGE, WIDENING, FittedProposal, StudentProposal
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.space import ScoreSpace, Space, normal_scores
from swesbi.prior import BoxPrior
from swesbi.recording.observation import Observation
from swesbi.seeds import generator

STREAM: Final = "change"
FITTED = 2000  # draws behind the fit of each visit
DEGREES_OF_FREEDOM = 25  # of thirty parameters: with 8 most draws lie too far out, and half as many count
LEAST_PRECISION = 0.3  # of a direction of u: the prior of both is never much wider than those of each
LEAST_VARIANCE = 1e-4  # of a normal score; nothing measured is known better
LEAST_INFORMATION = 1e-3
"""Share of a score's prior variance below which a recording says nothing of it."""


@dataclass(frozen=True)
class JoinedSpace:
    """The spaces of both visits' hearts side by side, as a space of psi."""

    spaces: tuple[Space, ...]
    coupling: Coupling

    def place(self, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return where psi (n, V d) lie, u (n, V d), and log |du / dpsi| of shape (n,)."""
        parts = self.coupling.phi(phi)
        placed = [space.place(part) for space, part in zip(self.spaces, parts, strict=True)]
        log_slope = np.sum([slope for _, slope in placed], axis=0) + self._coupled_slope(phi, parts)
        return np.hstack([u for u, _ in placed]), np.asarray(log_slope)

    def at(self, u: FloatArray) -> FloatArray:
        """Return psi (n, V d) of points u (n, V d)."""
        parts = np.split(u, self.coupling.visits, axis=1)
        return self.coupling.psi(
            np.stack([space.at(part) for space, part in zip(self.spaces, parts, strict=True)])
        )

    def _coupled_slope(self, psi: FloatArray, phi: FloatArray) -> FloatArray:
        """Return log |dphi / dpsi|: psi to independent scores, to those of the visits, to phi."""
        diagonal = np.diagonal(self.coupling.factors, axis1=1, axis2=2)
        to_scores = ScoreSpace(self.coupling.joint).place(psi)[1]
        back = sum(ScoreSpace(self.coupling.prior).place(part)[1] for part in phi)
        return np.asarray(to_scores + np.log(diagonal).sum() - back)


def joined_proposal(
    visits: VisitsModel, phi: Sequence[FloatArray], spaces: Sequence[Space]
) -> FittedProposal:
    """Return a Student distribution in the joined space about the normal approximation of the posterior.

    ``phi`` are equally weighted draws (m, d) of each visit's own posterior, ``spaces`` those of its network.
    """
    fits = [
        _fit(one, each[:FITTED], space, visits.coupling.shares)
        for one, each, space in zip(visits.models, phi, spaces, strict=True)
    ]
    mean, precision, offset, slope, rest = zip(*fits, strict=True)
    slopes, added = block_diag(*slope), _added_precision(visits)
    added = added @ np.linalg.inv(np.eye(len(added)) + block_diag(*rest) @ added)
    own = np.concatenate([of_one @ at for of_one, at in zip(precision, mean, strict=True)])
    linear = own - slopes.T @ added @ np.concatenate(offset)
    spread, axes = np.linalg.eigh(block_diag(*precision) + slopes.T @ added @ slopes)
    covariance = (axes / np.maximum(spread, LEAST_PRECISION)) @ axes.T
    student = StudentProposal(covariance @ linear, WIDENING * covariance, DEGREES_OF_FREEDOM)
    return FittedProposal(student, JoinedSpace(tuple(spaces), visits.hearts))


def _fit(
    model: SpeedModel, phi: FloatArray, space: Space, shares: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return a visit in its space: N(mean, precision^-1), and what ties it to others as offset + slopes u.

    The latter are scores of tied parameters, then residuals of log speeds. What measures a heart is not in u,
    and scatters them with the covariance that comes last.
    """
    prior = model.settings.prior
    u, _ = space.place(prior.heart(phi))
    residuals = np.log(model.recording.speed_m_s) - model.predict(phi).log_speed
    tying = np.hstack([normal_scores(phi, prior)[:, np.flatnonzero(shares)], residuals])
    known = np.isfinite(u).all(axis=1) & np.isfinite(tying).all(axis=1)
    u, tying = u[known], tying[known]
    design = np.column_stack([np.ones(len(u)), u])
    line = np.asarray(np.linalg.lstsq(design, tying, rcond=None)[0])
    precision = np.asarray(np.linalg.inv(np.cov(u.T) + RIDGE * np.eye(u.shape[1])))
    rest = np.asarray(np.cov((tying - design @ line).T))
    return u.mean(axis=0), precision, line[0], line[1:].T, rest


def _added_precision(model: VisitsModel) -> FloatArray:
    """Return what ties add to the precision of scores and residuals, in the order of ``_fit``.

    R^-1 - I of the scores, and the inverse of the covariance of all errors less those of each visit.
    """
    shares = np.diag(model.coupling.shares[model.coupling.shares > 0.0])
    own = np.eye(len(shares))
    correlation = np.block([[own, shares], [shares, own]])
    scores = np.linalg.inv(correlation) - np.eye(len(correlation))
    covariance = model.error_covariance()
    sizes = [len(index) for index in model.phase_index]
    starts = np.cumsum([0, *sizes])
    alone = [np.linalg.inv(covariance[a:b, a:b]) for a, b in zip(starts[:-1], starts[1:], strict=True)]
    errors = np.linalg.inv(covariance) - block_diag(*alone)
    whole = block_diag(scores, errors)
    # scores of all visits, then residuals of all; wanted is visit by visit
    visit = np.concatenate([np.repeat([0, 1], len(shares)), np.repeat([0, 1], sizes)])
    order = np.argsort(visit, kind="stable")
    return np.asarray(whole[np.ix_(order, order)])


@dataclass(frozen=True)
class NormalVisit:
    """What one recording says by itself, as a normal posterior N(m, C) of scores whose prior is N(0, I).

    A recording adds no width, so eigenvalues of C are at most 1; shapes are (d,) and (d, d).
    """

    mean: FloatArray
    covariance: FloatArray
    effective_draws: float


def normal_visit(exact: ExactPosterior, prior: BoxPrior) -> NormalVisit:
    """Return the normal approximation of a visit's own posterior."""
    scores = normal_scores(exact.phi, prior)
    weight = equal_weights(len(scores))
    mean = weight @ scores
    spread, axes = np.linalg.eigh((scores - mean).T @ ((scores - mean) * weight[:, None]))
    covariance = (axes * np.clip(spread, LEAST_VARIANCE, 1.0)) @ axes.T
    effective = exact.effective_draws.min() if exact.by_mcmc else exact.efficiency * len(exact.weighted.phi)
    return NormalVisit(mean, covariance, float(min(effective, len(exact.phi))))


def judge_one_person(
    visits: Sequence[NormalVisit],
    shares: FloatArray,
    log_bayes_factor: float,
    level: float,
    draws: int,
    rng: np.random.Generator,
) -> OnePerson:
    """Test that two recordings are of one person, by so many simulated pairs.

    Where all shares (d,) are zero nothing can be told, and nothing is flagged. The Bayes factor is reported
    only.
    """
    one, two = _covariances(visits, shares)
    means = np.concatenate([visit.mean for visit in visits])
    roots = [np.asarray(np.linalg.cholesky(covariance)) for covariance in (one, two)]
    null = rng.standard_normal((draws, len(means))) @ roots[0].T
    (observed,), simulated = (
        _log_normal(x, roots[0]) - _log_normal(x, roots[1]) for x in (means[None], null)
    )
    tied = np.flatnonzero(shares)
    p_value = (1.0 + (simulated <= observed).sum()) / (1.0 + draws) if len(tied) else 1.0
    return OnePerson(float(log_bayes_factor), float(observed), float(p_value), level, _distance(visits, tied))


def _distance(visits: Sequence[NormalVisit], tied: np.ndarray) -> float:
    """Return the distance of two posteriors in the parameters ``tied``, in posterior standard deviations.

    Mahalanobis's, by the sum of both covariances; 0 where nothing is tied.
    """
    if not len(tied):
        return 0.0
    apart = (visits[1].mean - visits[0].mean)[tied]
    covariance = sum(visit.covariance[np.ix_(tied, tied)] for visit in visits)
    return float(np.sqrt(apart @ np.linalg.solve(covariance, apart)))


def _covariances(visits: Sequence[NormalVisit], shares: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the covariance of both means, of one person and of two; (2 d, 2 d) each."""
    unit = np.eye(len(shares))
    told = [unit - visit.covariance for visit in visits]
    own = [
        each + visit.covariance / visit.effective_draws + LEAST_INFORMATION * unit
        for each, visit in zip(told, visits, strict=True)
    ]
    cross, nothing = told[0] @ np.diag(shares) @ told[1], np.zeros_like(told[0])
    one = np.block([[own[0], cross], [cross.T, own[1]]])
    return one, np.block([[own[0], nothing], [nothing, own[1]]])


def _log_normal(values: FloatArray, root: FloatArray) -> FloatArray:
    z = np.asarray(np.linalg.solve(root, values.T).T)
    return np.asarray(normal_log_density(z, np.log(np.diag(root))).sum(axis=1))


@dataclass(frozen=True)
class Change:
    """What two visits of one person say together: joint draws, ratios, and whether it is one person.

    Shapes are (2, n, d) of phi and (2, n, 4) of the quantities, NaN where there is no beat; ``efficiency`` is
    of all draws after each round.
    """

    exact: ExactPosterior
    phi: FloatArray
    quantities: FloatArray
    ratios: Ratios
    one_person: OnePerson
    efficiency: tuple[float, ...]


def both_visits(
    models: Sequence[SpeedModel], observed: Sequence[Observation], settings: ChangeSettings
) -> VisitsModel:
    """Return the model of two visits of one person, in what they share as configured."""
    shares = settings.shares
    return visits_model(
        models,
        [each.phase_index[each.measured] for each in observed],
        shares.of(models[0].settings.prior.names),
        shares.discrepancy,
    )


def infer_change(
    model: VisitsModel,
    own: Sequence[ExactPosterior],
    spaces: Sequence[Space],
    settings: ChangeSettings,
    seed: int,
    *name: str | int,
) -> Change:
    """Infer two visits together, from the posterior of each by itself, and the space of its network.

    ``name`` names the random streams: the person, say. Raises ValueError where no draw has a beat at both.
    """
    if len(model.models) != 2 or len(own) != 2:
        raise ValueError(f"{len(model.models)} visits: a change is between two")
    first = joined_proposal(model, [each.phi for each in own], spaces)
    exact, drawn = exact_posterior(model, first, settings.exact, seed, STREAM, *name)
    phi = model.coupling.phi(exact.phi)
    quantities = np.stack([quantities_of(one, rows) for one, rows in zip(model.models, phi, strict=True)])
    rng = generator(seed, STREAM, *name, "independent")
    draws = min(len(each.phi) for each in own)
    paired_at_random = [
        quantities_of(one, each.phi[rng.permutation(len(each.phi))[:draws]])
        for one, each in zip(model.models, own, strict=True)
    ]
    joint, independent = log_ratios(list(quantities)), log_ratios(paired_at_random)
    return Change(
        exact=exact,
        phi=phi,
        quantities=quantities,
        ratios=summarise_ratios(joint, independent, settings.exact.interval, settings.rule),
        one_person=judge_one_person(
            [normal_visit(each, model.of_one) for each in own],
            model.coupling.shares,
            exact.log_evidence - sum(each.log_evidence for each in own),
            settings.rule.one_person_level,
            settings.rule.null_draws,
            rng,
        ),
        efficiency=drawn.efficiency,
    )


def stored_change(
    change: Change,
    person: str,
    visits: tuple[str, str],
    subjects: tuple[str, str],
    verdicts: tuple[str, str],
    settings: ChangeSettings,
    parameters: tuple[str, ...],
) -> StoredChange:
    """Return what is kept of a change: whose, between which visits and recordings, of which verdicts."""
    exact, shares = change.exact, settings.shares.model_dump()
    return StoredChange(
        visit=visits,
        quantity=QUANTITIES,
        parameter=parameters,
        share=tuple(shares),
        person=person,
        subject=np.array(subjects),
        verdict=np.array(verdicts),
        phi=change.phi,
        quantities=change.quantities,
        shares=np.array(list(shares.values())),
        ratios=change.ratios,
        one_person=change.one_person,
        sampler=exact.sampler,
        converged=exact.converged,
        reasons=SEPARATOR.join(exact.reasons),
        k_hat=exact.k_hat,
        k_hat_limit=exact.k_hat_limit,
        efficiency=exact.efficiency,
        weighted_draws=len(exact.weighted.phi),
        log_evidence=exact.log_evidence,
        log_evidence_se=exact.weighted.log_evidence_se,
        interval_mass=settings.exact.interval,
        threshold=settings.rule.threshold,
        probability=settings.rule.probability,
    )
