"""The paper's criterion: is a subject represented by the prior predictive at all? (paper, Sec. 2.5)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.base.progress import LOGGER
from swesbi.networks.paper.estimator import TrainedEstimator, draw_candidates
from swesbi.networks.paper.pool import Pool
from swesbi.parameters import THETA_NAMES
from swesbi.posterior.settings import PosteriorSettings
from swesbi.posterior.truncated import Posterior, summarise_posterior
from swesbi.prior import PriorSettings, bounds, in_bounds
from swesbi.seeds import integer_seed
from swesbi.verdict.settings import SupportSettings
from swesbi.verdict.verdict import Status, Verdict

NAMED_COMPONENTS = 3


def diagnose(
    z_obs: FloatArray,
    component_names: tuple[str, ...],
    candidates: FloatArray,
    prior: PriorSettings,
    settings: SupportSettings,
) -> Verdict:
    """Apply both criteria: max |z_obs| <= max_abs_z, and enough candidates within the prior's bounds.

    ``z_obs`` (C,) is standardised with the pool's statistics; candidates (n, 3) are the estimator's,
    unfiltered.
    """
    inside = int(in_bounds(candidates, prior).sum())
    median = np.nanmedian(np.where(np.isfinite(candidates), candidates, np.nan), axis=0)
    reasons = (
        *_far_components(z_obs, component_names, settings.max_abs_z),
        *_leakage(inside, len(candidates), median, prior, settings.min_in_prior_draws),
    )
    worst = int(np.argmax(np.abs(z_obs)))
    found = f"max |z| = {np.abs(z_obs[worst]):.2f}, {inside} of {len(candidates)} candidate draws in bounds"
    status = Status.NOT_PRIOR_SUPPORTED if reasons else Status.PRIOR_SUPPORTED
    return Verdict(
        max_abs_z=float(np.abs(z_obs[worst])),
        worst_component=component_names[worst],
        in_prior_draws=inside,
        candidate_draws=len(candidates),
        unfiltered_median=dict(zip(THETA_NAMES, map(float, median), strict=True)),
        status=status,
        sentence=f"{status}: {'; '.join(reasons) if reasons else found}",
        reasons=reasons,
    )


def _far_components(z_obs: FloatArray, names: tuple[str, ...], limit: float) -> list[str]:
    """Count the components beyond the limit and name the farthest."""
    order = np.argsort(-np.abs(z_obs))
    far = [f"{names[j]} (z = {z_obs[j]:.2f})" for j in order if not abs(z_obs[j]) <= limit]
    if not far:
        return []
    more = ", ..." if len(far) > NAMED_COMPONENTS else ""
    return [
        f"{len(far)} of {len(names)} components outside what the prior predicts, |z| <= {limit:g} required: "
        f"{', '.join(far[:NAMED_COMPONENTS])}{more}"
    ]


def _leakage(inside: int, drawn: int, median: FloatArray, prior: PriorSettings, required: int) -> list[str]:
    """Say that too few candidates lie within the bounds, and which medians lie beyond them."""
    if inside >= required:
        return []
    low, high = bounds(prior)
    beyond = [
        f"{name} {median[j]:.1f} outside [{low[j]:g}, {high[j]:g}]"
        for j, name in enumerate(THETA_NAMES)
        if not low[j] <= median[j] <= high[j]
    ]
    tail = f"; unfiltered median of {', '.join(beyond)}" if beyond else ""
    return [f"{inside} of {drawn} candidate draws lie within the prior's bounds, {required} required{tail}"]


class PosteriorVerdict(NamedTuple):
    """The posterior of a subject, and the verdict on its prior support."""

    posterior: Posterior
    verdict: Verdict


def judged_posterior(
    pool: Pool,
    estimator: TrainedEstimator,
    *,
    subject: str,
    prior: PriorSettings,
    support: SupportSettings,
    posterior: PosteriorSettings,
    seed: int,
) -> PosteriorVerdict:
    """Draw candidates for a subject, judge its prior support, keep the draws within the prior.

    A subject that is not prior-supported keeps its draws, if it has any, and its verdict.

    Raises:
        UnfitError: The estimator was trained on other components than the pool's.
        KeyError: The pool holds no such subject.
    """
    pool.check_components(estimator.components, "estimator")
    z_obs, names = pool.observed_z(subject), pool.components.names
    drawn_by = integer_seed(seed, "posterior", subject)
    candidates = draw_candidates(estimator, z_obs[None], support.candidate_draws, drawn_by)[0]
    verdict = diagnose(z_obs, names, candidates, prior, support)
    LOGGER.info("subject %s: %s", subject, verdict.sentence)
    return PosteriorVerdict(summarise_posterior(candidates, z_obs, names, prior, posterior), verdict)
