"""An exact posterior made of plain draws, with a sampling check that is given."""

from __future__ import annotations

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.posterior.importance import WeightedDraws
from swesbi.posterior.result import ExactPosterior, Sampler

NAMES = ("maximum_kpa", "hr_bpm")
Z = np.array([0.4, -1.9])


def exact_of(
    phi: FloatArray,
    proposal_phi: FloatArray | None = None,
    *,
    sampler: Sampler = "importance",
    k_hat: float = 0.3,
    efficiency: float = 0.2,
    r_hat: float = np.nan,
    converged: bool = True,
    reasons: tuple[str, ...] = (),
    components: tuple[str, ...] = NAMES,
    condition: FloatArray = Z,
) -> ExactPosterior:
    """Return a posterior with these draws, all of them of equal weight."""
    n, d = phi.shape
    weighted = WeightedDraws(
        phi=phi,
        from_prior=np.arange(n) >= 0.9 * n,
        log_likelihood=np.zeros(n),
        log_weight=np.full(n, -np.log(n)),
        k_hat=k_hat,
        efficiency=efficiency,
        log_evidence=1.0,
        log_evidence_se=0.1,
    )
    return ExactPosterior(
        phi=phi,
        sampler=sampler,
        reasons=reasons,
        k_hat_limit=0.7,
        proposal_phi=phi if proposal_phi is None else proposal_phi,
        weighted=weighted,
        r_hat=np.full(d, r_hat),
        effective_draws=np.full(d, efficiency * n),
        mcmc_steps=0,
        converged=converged,
        interval_mass=0.9,
        condition=condition,
        components=components,
    )
