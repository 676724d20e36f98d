"""MCMC on the exact posterior by emcee: independent ensembles, extended until they agree."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, Final, Protocol

import arviz
import emcee
import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from swesbi.posterior.importance import LikelihoodModel, WeightedDraws, log_posterior_of_logit
from swesbi.posterior.settings import McmcSettings, warm_up_steps
from swesbi.prior import from_logit, to_logit

FloatArray = NDArray[np.float64]
INFLATION: Final = 4.0  # of the covariance of the weighted draws: twice their spread
LEAST_SD: Final = 0.1  # in eta; a few dominating weights have no spread of their own
ATTEMPTS: Final = 100
State = Any  # emcee.State: coords (walkers, d), log_prob (walkers,)
GAMMA_SD: Final = 0.1  # relative spread of the step's factor: keeps proposals off a lattice
JUMP_SHARE: Final = 0.1  # of the steps, with factor one: from mode to mode (ter Braak 2006)
STRETCH_SHARE: Final = 0.3  # of the steps: they bring walkers back that started or strayed far off
STRAY_PROBABILITY: Final = 1e-4


def starting_points(
    model: LikelihoodModel, weighted: WeightedDraws, count: int, rng: np.random.Generator
) -> FloatArray:
    """Return distinct phi (count, d) that have a likelihood: draws of the proposal, picked at random.

    Where the proposal itself has too few, over-dispersed points about the weighted draws fill up.

    Raises:
        ValueError: Not enough points with a likelihood are found there either.
    """
    usable = ~weighted.from_prior & np.isfinite(weighted.log_likelihood)
    phi = np.unique(weighted.phi[usable], axis=0)
    if len(phi) >= count:
        return phi[rng.choice(len(phi), count, replace=False)]
    shuffled = phi[rng.permutation(len(phi))]
    return np.concatenate([shuffled, overdispersed(model, weighted, count - len(phi), rng)])


def overdispersed(
    model: LikelihoodModel, weighted: WeightedDraws, count: int, rng: np.random.Generator
) -> FloatArray:
    """Return phi (count, d) with a likelihood, normal in eta with twice the spread of the weighted draws.

    Raises:
        ValueError: Not enough points with a likelihood are found.
    """
    prior = model.settings.prior
    eta = to_logit(weighted.phi, prior)
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


@dataclass(frozen=True)
class McmcDraws:
    """Draws of independent ensembles, warm-up left out.

    Attributes:
        phi: Draws in the order of steps, all walkers of a step together; shape (ensembles, n, d).
        walkers: Walkers of an ensemble; n is a multiple of them.
        r_hat: Rank-normalised split R-hat over the ensembles, by parameter; shape (d,).
        effective_draws: Effective number of draws, by parameter; shape (d,).
        steps: Steps of each walker, warm-up included.
        converged: Every R-hat is below its limit, and there are as many effective draws as asked for.
    """

    phi: FloatArray
    walkers: int
    r_hat: FloatArray
    effective_draws: FloatArray
    steps: int
    converged: bool

    def thinned(self, draws: int, rng: np.random.Generator) -> FloatArray:
        """Return draws (draws, d) of steps as far apart as can be, in random order.

        Raises:
            ValueError: More are asked for than there are.
        """
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
    model: LikelihoodModel, start_phi: FloatArray, settings: McmcSettings, seed: int, least_effective: int = 0
) -> McmcDraws:
    """Sample the exact posterior in eta = logit(phi) by several ensembles of walkers.

    Moves are emcee's differential evolution (ter Braak 2006; Nelson et al. 2014), mixed with its stretch
    move (Goodman and Weare 2010). Rounds of ``settings.steps`` follow one
    another until R-hat (Vehtari et al. 2021) and the effective draws are met or ``settings.max_steps`` is
    reached; the first share of all steps is left out anew after each. Effective draws count beside R-hat,
    which passes ensembles of which a walker or two still stray where hardly any posterior mass is.

    Args:
        model: Prior and exact likelihood of the recording.
        start_phi: Where the walkers start, inside the prior's box; shape (ensembles * walkers, 4).
        settings: Ensembles, walkers, steps, the limit of R-hat and the least number of effective draws.
        seed: Seed of the sampler.
        least_effective: Least number of effective draws of every parameter, where the settings ask for fewer.

    Raises:
        ValueError: ``start_phi`` has another number of rows, or one of them no posterior density.
    """
    wanted = max(least_effective, settings.min_effective_draws)
    sampler, state = _sampler(model, start_phi, settings, seed)
    state = sampler.run_mcmc(state, warm_up_steps(settings.steps, settings.warm_up_fraction))
    gather(state, settings.ensembles)
    # the warm-up is a share of all steps, so each further round leaves out more of what the start has shaped
    while True:
        steps = settings.steps - sampler.iteration % settings.steps
        state = sampler.run_mcmc(state, min(steps, settings.max_steps - sampler.iteration))
        draws = _judged(sampler, model, settings, wanted)
        if draws.converged or sampler.iteration >= settings.max_steps:
            return draws


def reference_draws(
    model: LikelihoodModel, start_phi: FloatArray, draws: int, settings: McmcSettings, seed: int
) -> FloatArray:
    """Return draws (draws, d) of the exact posterior that are as good as independent, by long MCMC.

    The sampler runs until its effective draws are twice as many as are kept, so that these lie about two
    autocorrelation times apart.

    Raises:
        ValueError: The sampler did not get there within ``settings.max_steps``.
    """
    sampled = sample_mcmc(model, start_phi, settings, seed, least_effective=2 * draws)
    if not sampled.converged:
        raise ValueError(
            f"after {sampled.steps} steps R-hat is {sampled.r_hat.max():.4f} and the effective draws are "
            f"{sampled.effective_draws.min():.0f} of {2 * draws}; raise max_steps"
        )
    return sampled.thinned(draws, np.random.default_rng(seed))


def split_r_hat(phi: FloatArray) -> FloatArray:
    """Return the rank-normalised split R-hat of draws (chain, n, d); shape (d,)."""
    columns = np.moveaxis(phi, -1, 0)
    return np.array([float(arviz.rhat(column, method="rank")) for column in columns])  # type: ignore[no-untyped-call]


def gather(state: emcee.State, ensembles: int) -> None:
    """Put walkers that stray after the first warm-up onto others of their ensemble, at most half of it.

    From a bad start some end in corners of next to no posterior mass and leave them only after hundreds of
    steps. Walkers count as stray whose density no normal posterior would show in 10,000 draws. What comes
    before is left out, so this chooses a better start and nothing else.
    """
    log_prob = state.log_prob.reshape(ensembles, -1)
    size = log_prob.shape[1]
    lowest = log_prob.max(axis=1) - 0.5 * chi2(state.coords.shape[1]).isf(STRAY_PROBABILITY)
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
    number = np.array([float(arviz.ess(mean, method="mean")) for mean in means])  # type: ignore[no-untyped-call]
    variance = chain.reshape(-1, chain.shape[-1]).var(axis=0)
    return np.asarray(number * variance / means.var(axis=(1, 2)))


def _sampler(
    model: LikelihoodModel, start_phi: FloatArray, settings: McmcSettings, seed: int
) -> tuple[emcee.EnsembleSampler, emcee.State]:
    if len(start_phi) != settings.start_points:
        raise ValueError(f"start_phi has {len(start_phi)} rows; there are {settings.start_points} walkers")

    log_posterior = partial(log_posterior_of_logit, model)
    eta = to_logit(start_phi, model.settings.prior)
    log_prob = log_posterior(eta)
    if not np.isfinite(log_prob).all():
        row = int(np.flatnonzero(~np.isfinite(log_prob))[0])
        raise ValueError(f"start_phi row {row}, {start_phi[row]}: its simulation fails; start elsewhere")
    sampler = emcee.EnsembleSampler(
        *eta.shape, log_posterior, moves=_moves(settings.ensembles), vectorize=True
    )
    random_state = np.random.RandomState(seed).get_state()
    return sampler, emcee.State(eta, log_prob=log_prob, random_state=random_state)


def _moves(ensembles: int) -> list[tuple[SideBySide, float]]:
    """Return the moves with the shares of the steps that they take."""
    moves = emcee.moves
    shares = [
        (moves.DEMove(sigma=GAMMA_SD), 1.0 - JUMP_SHARE - STRETCH_SHARE),
        (moves.DEMove(sigma=GAMMA_SD, gamma0=1.0), JUMP_SHARE),
        (moves.StretchMove(), STRETCH_SHARE),
    ]
    return [(SideBySide(move, ensembles), share) for move, share in shares]


def _judged(
    sampler: emcee.EnsembleSampler, model: LikelihoodModel, settings: McmcSettings, wanted: int
) -> McmcDraws:
    """Return what the sampler has after its warm-up, with R-hat and effective draws."""
    eta = sampler.get_chain(discard=warm_up_steps(sampler.iteration, settings.warm_up_fraction))
    by_ensemble = eta.reshape(len(eta), settings.ensembles, settings.walkers, -1).swapaxes(0, 1)
    draws = by_ensemble.reshape(settings.ensembles, len(eta) * settings.walkers, -1)
    r_hat, effective = split_r_hat(draws), effective_draws(by_ensemble)
    return McmcDraws(
        phi=from_logit(draws, model.settings.prior),
        walkers=settings.walkers,
        r_hat=r_hat,
        effective_draws=effective,
        steps=sampler.iteration,
        converged=bool((r_hat < settings.max_r_hat).all() and (effective >= wanted).all()),
    )
