"""MCMC on the exact posterior by emcee: independent ensembles, extended until they agree."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from swesbi.base.arrays import FloatArray
from swesbi.base.progress import LOGGER
from swesbi.posterior.diagnostics import effective_number, split_r_hat
from swesbi.posterior.importance import LikelihoodModel, WeightedDraws, points_of
from swesbi.posterior.settings import McmcSettings, warm_up_steps
from swesbi.posterior.space import LogitSpace, Space, log_posterior_in
from swesbi.prior import BoxPrior, from_logit, to_logit

if TYPE_CHECKING:  # half a second to import, which the many posteriors without MCMC need not wait for
    import emcee

State = Any  # emcee.State: coords (walkers, d), log_prob (walkers,)
GAMMA_SD: Final = 0.1  # relative spread of the step's factor: keeps proposals off a lattice
JUMP_SHARE: Final = 0.1  # of the steps, with factor one: from mode to mode (ter Braak 2006)
STRETCH_SHARE: Final = 0.3  # of the steps: they bring walkers back that started or strayed far off
NORMAL_SHARE: Final = 0.5  # of the steps, where the posterior is near normal; the others need no such space
LEAST_RENEWED: Final = 0.3  # of a walker, by such a step; at most all of it


class HalfMove(Protocol):
    """A move of emcee that proposes for one half of an ensemble from the other half."""

    def setup(self, coords: FloatArray) -> None:
        """Prepare for walkers at these coordinates."""

    def get_proposal(
        self, s: FloatArray, c: list[FloatArray], random: np.random.RandomState
    ) -> tuple[FloatArray, FloatArray]:
        """Return proposals for s of shape (n, d) from the complement c, and the log of their factors."""


class SideBySide:
    """Moves independent ensembles side by side, so that one call evaluates the walkers of all of them.

    The walkers of an ensemble are neighbours in the sampler's order. Proposals of an ensemble see its own
    walkers only, in random halves (Foreman-Mackey et al. 2013, Alg. 3); the simulator is fastest in batches.
    """

    def __init__(self, move: HalfMove, ensembles: int) -> None:
        self._move = move
        self._ensembles = ensembles

    def propose(self, model: Any, state: State) -> tuple[State, NDArray[np.bool_]]:  # noqa: ANN401
        """Move every walker once; the interface of emcee's moves."""
        self._move.setup(state.coords)
        accepted = np.zeros(len(state.coords), dtype=bool)
        first, second = self._halves(len(state.coords), model.random)
        # in turns: a proposal made from walkers that move at the same time would break detailed balance
        for moving, still in ((first, second), (second, first)):
            self._move_half(model, state, moving, still, accepted)
        return state, accepted

    def _halves(
        self, walkers: int, random: np.random.RandomState
    ) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
        """Return walkers of two random halves of each ensemble; (ensembles, walkers of it / 2) each."""
        size = walkers // self._ensembles
        # drawn anew at each step: with fixed halves a walker would never see the others of its own half
        order = np.stack([k * size + random.permutation(size) for k in range(self._ensembles)])
        return order[:, : size // 2], order[:, size // 2 :]

    def _move_half(
        self,
        model: Any,  # noqa: ANN401
        state: State,
        moving: NDArray[np.int_],
        still: NDArray[np.int_],
        accepted: NDArray[np.bool_],
    ) -> None:
        proposals = [
            self._move.get_proposal(state.coords[rows], [state.coords[others]], model.random)
            for rows, others in zip(moving, still, strict=True)
        ]
        coords, log_factor = (np.concatenate(parts) for parts in zip(*proposals, strict=True))
        # one call for all ensembles: the simulator is fast in large batches, half an ensemble is small
        log_prob, _ = model.compute_log_prob_fn(coords)
        rows = moving.ravel()
        taken = log_factor + log_prob - state.log_prob[rows] > np.log(model.random.rand(len(rows)))
        state.coords[rows[taken]] = coords[taken]
        state.log_prob[rows[taken]] = log_prob[taken]
        accepted[rows] = taken


class NearNormal:
    """The preconditioned Crank-Nicolson step (Cotter, Roberts, Stuart and White 2013, Stat Sci 28:424).

    It keeps the standard normal distribution, so that acceptance is how far the posterior differs from it:
    where that is little, steps of any length are taken, whatever the number of parameters.
    """

    def setup(self, coords: FloatArray) -> None:
        """Prepare for nothing."""

    def get_proposal(
        self, s: FloatArray, c: list[FloatArray], random: np.random.RandomState
    ) -> tuple[FloatArray, FloatArray]:
        """Return sqrt(1 - b^2) s + b xi for s of shape (n, d), and the log of N(s) / N(proposal); (n,)."""
        del c  # no step looks at the other walkers
        renewed = random.uniform(LEAST_RENEWED, 1.0, (len(s), 1))
        proposal = np.sqrt(1.0 - renewed**2) * s + renewed * random.normal(size=s.shape)
        return proposal, 0.5 * ((proposal**2).sum(axis=1) - (s**2).sum(axis=1))


def moves(ensembles: int, near_normal: bool) -> list[tuple[SideBySide, float]]:
    """Return the moves with their shares of the steps; others where the posterior is near normal."""
    import emcee

    shares = [
        (emcee.moves.DEMove(sigma=GAMMA_SD), 1.0 - JUMP_SHARE - STRETCH_SHARE),
        (emcee.moves.DEMove(sigma=GAMMA_SD, gamma0=1.0), JUMP_SHARE),
        (emcee.moves.StretchMove(), STRETCH_SHARE),
    ]
    if near_normal:
        shares = [(move, (1.0 - NORMAL_SHARE) * share) for move, share in shares]
        shares.append((NearNormal(), NORMAL_SHARE))
    return [(SideBySide(move, ensembles), share) for move, share in shares]


INFLATION: Final = 4.0  # of the covariance of the weighted draws: twice their spread
LEAST_SD: Final = 0.1  # in eta; a few dominating weights have no spread of their own
ATTEMPTS: Final = 100
STRAY_PROBABILITY: Final = 1e-4
FARTHEST: Final = 100.0  # from the origin of the space; no walker comes back from there


def starting_points(
    model: LikelihoodModel, weighted: WeightedDraws, count: int, rng: np.random.Generator
) -> FloatArray:
    """Return distinct points (count, k) that have a likelihood: draws of the proposal, picked at random.

    Where the proposal itself has too few, over-dispersed points about the weighted draws fill up.
    """
    usable = ~weighted.from_prior & np.isfinite(weighted.log_likelihood)
    points = np.unique(points_of(model, weighted.phi[usable]), axis=0)
    if len(points) >= count:
        return points[rng.choice(len(points), count, replace=False)]
    shuffled = points[rng.permutation(len(points))]
    return np.concatenate([shuffled, overdispersed(model, weighted, count - len(points), rng)])


def overdispersed(
    model: LikelihoodModel, weighted: WeightedDraws, count: int, rng: np.random.Generator
) -> FloatArray:
    """Return points (count, k) with a likelihood, normal in eta with twice the spread of the weighted draws.

    ValueError: not enough are found.
    """
    prior = model.settings.prior
    eta = to_logit(points_of(model, weighted.phi), prior)
    mean = weighted.weight @ eta
    covariance = (eta - mean).T @ ((eta - mean) * weighted.weight[:, None])
    covariance = INFLATION * covariance + LEAST_SD**2 * np.eye(len(mean))
    points = np.empty((0, len(mean)))
    for _ in range(ATTEMPTS):
        phi = from_logit(rng.multivariate_normal(mean, covariance, count), prior)
        points = np.concatenate([points, phi[np.isfinite(model.log_likelihood(phi))]])
        if len(points) >= count:
            return points[:count]
    raise ValueError(
        f"only {len(points)} of {count} starting points for MCMC have a likelihood: nearly every simulation "
        "fails about the weighted draws; check the subject's context"
    )


@dataclass(frozen=True)
class McmcDraws:
    """Draws of independent ensembles, warm-up left out.

    phi (ensembles, n, d) has the order of steps, all walkers of a step together. R-hat (rank-normalised,
    split, over the ensembles) and effective draws are by parameter. Steps of a walker include the warm-up.
    """

    phi: FloatArray
    walkers: int
    r_hat: FloatArray
    effective_draws: FloatArray
    steps: int
    converged: bool

    def thinned(self, draws: int, rng: np.random.Generator) -> FloatArray:
        """Return draws (draws, d) of steps as far apart as can be, in random order."""
        ensembles, kept, dimensions = self.phi.shape
        if draws > ensembles * kept:
            raise ValueError(f"{draws} draws asked for, the sampler kept {ensembles * kept}; raise its steps")
        steps = kept // self.walkers
        wanted = -(-draws // (ensembles * self.walkers))
        spaced = (np.arange(wanted) * steps) // wanted
        by_step = self.phi.reshape(ensembles, steps, self.walkers, dimensions)
        phi = by_step[:, spaced].reshape(-1, dimensions)
        return np.asarray(phi[rng.permutation(len(phi))[:draws]])


def sample_mcmc(
    model: LikelihoodModel,
    start_phi: FloatArray,
    settings: McmcSettings,
    seed: int,
    space: Space | None = None,
) -> McmcDraws:
    """Sample the exact posterior by several ensembles of walkers, in eta = logit(phi) or in another space.

    Moves are emcee's differential evolution (ter Braak 2006; Nelson et al. 2014), mixed with its stretch
    move (Goodman and Weare 2010). In the base space of a flow that knows the posterior roughly (the map of
    Parno and Marzouk 2018, SIAM/ASA J Uncertain Quantif 6:645, as in :mod:`swesbi.posterior.fitted`) half of
    the steps are :class:`NearNormal`: what the flow has wrong costs acceptance, and
    the draws are of the same posterior. Rounds of ``settings.steps`` follow one another until R-hat (Vehtari
    et al. 2021) and the effective draws are met or ``settings.max_steps`` is reached; the first share of all
    steps is left out anew after each. Effective draws count beside R-hat, which passes ensembles of which a
    walker or two still stray where hardly any posterior mass is.

    Walkers start at (ensembles * walkers, 4) points inside the prior's box. ValueError: there are others than
    these, or one has no posterior density.
    """
    where = LogitSpace(model.settings.prior) if space is None else space
    used = moves(settings.ensembles, near_normal=space is not None)
    sampler, state = _sampler(model, start_phi, settings, where, used, seed)
    state = sampler.run_mcmc(state, warm_up_steps(settings.steps, settings.warm_up_fraction))
    gather(state, settings.ensembles)
    # the warm-up is a share of all steps, so each further round leaves out more of what the start has shaped
    while True:
        steps = settings.steps - sampler.iteration % settings.steps
        state = sampler.run_mcmc(state, min(steps, settings.max_steps - sampler.iteration))
        draws = _judged(sampler, where, model.settings.prior, settings)
        if draws.converged or sampler.iteration >= settings.max_steps:
            return draws
        LOGGER.info(
            "MCMC: %d of at most %d steps, R-hat %.3f (below %g is needed), %.0f of %d effective draws",
            sampler.iteration, settings.max_steps, draws.r_hat.max(), settings.max_r_hat,
            draws.effective_draws.min(), settings.min_effective_draws,
        )  # fmt: skip


def gather(state: emcee.State, ensembles: int) -> None:
    """Put walkers that stray after the first warm-up onto others of their ensemble, at most half of it.

    From a bad start some end in corners of next to no posterior mass and leave them only after hundreds of
    steps. Walkers count as stray whose density no normal posterior would show in 10,000 draws. What comes
    before is left out, so this chooses a better start and nothing else.
    """
    log_prob = state.log_prob.reshape(ensembles, -1)
    size = log_prob.shape[1]
    lowest = log_prob.max(axis=1) - 0.5 * chdtri(state.coords.shape[1], STRAY_PROBABILITY)
    for ensemble, order in enumerate(np.argsort(log_prob, axis=1, kind="stable")):
        worse, better = order[: size // 2], order[size - size // 2 :]
        stray = log_prob[ensemble, worse] < lowest[ensemble]
        rows, sources = (ensemble * size + half[stray] for half in (worse, better))
        state.coords[rows] = state.coords[sources]
        state.log_prob[rows] = state.log_prob[sources]


def effective_draws(chain: FloatArray) -> FloatArray:
    """Return the effective number of draws by parameter, (d,), of a chain (ensembles, steps, walkers, d).

    It is the variance of a draw over that of the mean of all. The latter comes from the ensembles' means,
    step by step, and their effective number (Vehtari et al. 2021): the walkers of an ensemble are not
    independent, so counting each by itself promises too much (Goodman and Weare 2010, Sec. 3).
    """
    means = np.moveaxis(chain.mean(axis=2), -1, 0)
    number = np.array([effective_number(mean) for mean in means])
    variance = chain.reshape(-1, chain.shape[-1]).var(axis=0)
    return np.asarray(number * variance / means.var(axis=(1, 2)))


def _sampler(
    model: LikelihoodModel,
    start_phi: FloatArray,
    settings: McmcSettings,
    space: Space,
    used: list[tuple[SideBySide, float]],
    seed: int,
) -> tuple[emcee.EnsembleSampler, State]:
    import emcee

    if len(start_phi) != settings.start_points:
        raise ValueError(f"start_phi has {len(start_phi)} rows; there are {settings.start_points} walkers")

    log_posterior = partial(log_posterior_in, space, model)
    u = _within_reach(space.place(start_phi)[0])
    log_prob = log_posterior(u)
    if not np.isfinite(log_prob).all():
        row = int(np.flatnonzero(~np.isfinite(log_prob))[0])
        raise ValueError(f"start_phi row {row}, {start_phi[row]}: its simulation fails; start elsewhere")
    sampler = emcee.EnsembleSampler(*u.shape, log_posterior, moves=used, vectorize=True)
    random_state = np.random.RandomState(seed).get_state()
    return sampler, emcee.State(u, log_prob=log_prob, random_state=random_state)


def _within_reach(u: FloatArray) -> FloatArray:
    """Return starting points u (n, d); those far out in a flow's base space give way to nearer ones."""
    near = np.linalg.norm(u, axis=1) < FARTHEST
    if not near.any():
        return u
    # beside 1e8 the spread of all other walkers is lost in rounding, and emcee refuses the ensemble
    found = u.copy()
    found[~near] = np.resize(u[near], (int((~near).sum()), u.shape[1]))
    return found


def _judged(
    sampler: emcee.EnsembleSampler, space: Space, prior: BoxPrior, settings: McmcSettings
) -> McmcDraws:
    """Return what the sampler has after its warm-up, with R-hat and effective draws by parameter."""
    u = sampler.get_chain(discard=warm_up_steps(sampler.iteration, settings.warm_up_fraction))
    steps, dimensions = len(u), u.shape[-1]
    phi = space.at(u.reshape(-1, dimensions)).reshape(steps, settings.ensembles, settings.walkers, dimensions)
    by_ensemble = phi.swapaxes(0, 1)
    draws = by_ensemble.reshape(settings.ensembles, steps * settings.walkers, dimensions)
    eta = to_logit(by_ensemble.reshape(-1, dimensions), prior)
    r_hat, effective = split_r_hat(eta.reshape(draws.shape)), effective_draws(eta.reshape(by_ensemble.shape))
    return McmcDraws(
        phi=draws,
        walkers=settings.walkers,
        r_hat=r_hat,
        effective_draws=effective,
        steps=sampler.iteration,
        converged=bool(
            (r_hat < settings.max_r_hat).all() and (effective >= settings.min_effective_draws).all()
        ),
    )
