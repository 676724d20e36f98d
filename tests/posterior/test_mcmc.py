"""The sampler that takes over: it finds a known posterior, knows when it has not, and repeats."""

from __future__ import annotations

from dataclasses import dataclass

import emcee
import numpy as np
import pytest
from exact_case import LOG_SD, MCMC, PRIOR, ToyModel, check_posterior, known_mean, proposal, weigh
from pydantic import ValidationError
from scipy.signal import lfilter

from swesbi.posterior.mcmc import (
    McmcDraws,
    NearNormal,
    SideBySide,
    effective_draws,
    gather,
    overdispersed,
    sample_mcmc,
    split_r_hat,
    starting_points,
)
from swesbi.posterior.settings import McmcSettings
from swesbi.posterior.space import LogitSpace
from swesbi.prior import to_logit

SHORT = MCMC.model_copy(update={"steps": 60, "max_steps": 60, "min_effective_draws": 1})


def sampled(width: float = 0.3, shift: float = 3.0, settings: McmcSettings = MCMC) -> McmcDraws:
    """Start far too close together, and three standard deviations off."""
    start = proposal(width, shift).draw(settings.start_points, seed=5)
    return sample_mcmc(ToyModel(), start, settings, seed=7)


def test_the_sampler_finds_the_known_posterior() -> None:
    draws = sampled()
    assert draws.converged
    assert draws.r_hat.max() < 1.01
    assert draws.effective_draws.min() > 1000
    check_posterior(draws.phi.reshape(-1, 4), draws.effective_draws.min())
    check_posterior(draws.thinned(4000, np.random.default_rng(0)), draws.effective_draws.min())


@pytest.mark.parametrize("shared", [0.0, 0.5])
def test_effective_draws_count_what_steps_and_walkers_share(shared: float) -> None:
    """Walkers follow AR(1) series, whose mean is known to vary (1 + rho) / (1 - rho) times as much."""
    rho, ensembles, steps, walkers = 0.8, 4, 4000, 20
    noise = np.random.default_rng(3).standard_normal((ensembles, steps, walkers + 1))
    series = lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], noise, axis=1)
    chain = np.sqrt(shared) * series[:, :, :1] + np.sqrt(1.0 - shared) * series[:, :, 1:]
    independent = ensembles * steps * (1.0 - rho) / (1.0 + rho)
    expected = independent / (shared + (1.0 - shared) / walkers)
    assert effective_draws(chain[..., None])[0] == pytest.approx(expected, rel=0.25)


def test_thinned_draws_are_whole_steps_far_apart() -> None:
    draws = sampled(settings=SHORT)  # 45 steps of 128 walkers are left
    spaced = draws.phi.reshape(4, 45, 32, 4)[:, [0, 15, 30]].reshape(-1, 4)
    thinned = draws.thinned(3 * 128, np.random.default_rng(0))
    np.testing.assert_array_equal(np.sort(thinned, axis=0), np.sort(spaced, axis=0))
    assert not np.array_equal(thinned, spaced)
    assert draws.thinned(300, np.random.default_rng(0)).shape == (300, 4)
    with pytest.raises(ValueError, match="the sampler kept 5760"):
        draws.thinned(5761, np.random.default_rng(0))


def test_the_sampler_is_extended_until_its_ensembles_agree() -> None:
    draws = sampled(settings=MCMC.model_copy(update={"steps": 20, "max_steps": 2000}))
    assert draws.converged
    assert 20 < draws.steps < 2000
    assert draws.steps % 20 == 0
    assert draws.phi.shape == (4, 32 * (draws.steps - round(0.25 * draws.steps)), 4)


def test_a_sampler_that_does_not_converge_says_so_at_its_limit() -> None:
    draws = sampled(settings=MCMC.model_copy(update={"steps": 20, "max_steps": 50, "max_r_hat": 1.0001}))
    assert not draws.converged
    assert draws.steps == 50


def test_ensembles_that_disagree_have_a_large_r_hat() -> None:
    rng = np.random.default_rng(1)
    agreeing = rng.standard_normal((4, 2000, 2))
    assert split_r_hat(agreeing).max() < 1.005
    apart = agreeing + np.array([0.0, 0.0, 0.0, 1.0])[:, None, None] * np.array([1.0, 0.0])
    assert split_r_hat(apart)[0] > 1.05
    drifting = agreeing + np.linspace(0.0, 1.0, 2000)[None, :, None]
    assert split_r_hat(drifting).min() > 1.02


def test_ensembles_do_not_see_each_other() -> None:
    def chain(start: np.ndarray) -> np.ndarray:
        moves = [SideBySide(move, 4) for move in (emcee.moves.DEMove(), emcee.moves.StretchMove())]
        sampler = emcee.EnsembleSampler(
            64, 4, lambda x: -0.5 * (x**2).sum(axis=1), moves=moves, vectorize=True
        )
        sampler.run_mcmc(emcee.State(start, random_state=np.random.RandomState(1).get_state()), 30)
        return np.asarray(sampler.get_chain())

    start = np.random.default_rng(2).standard_normal((64, 4))
    moved = start.copy()
    moved[16:] *= 3.0
    first, second = chain(start), chain(moved)
    np.testing.assert_array_equal(first[:, :16], second[:, :16])
    assert not np.any(first[:, 16:] == second[:, 16:])
    assert np.all(first[:, :16].std(axis=0) > 0.0)


def test_draws_repeat_under_the_seed_whatever_numpys_own_state() -> None:
    np.random.seed(1)  # noqa: NPY002
    first = sampled(settings=SHORT)
    np.random.seed(2)  # noqa: NPY002
    again = sampled(settings=SHORT)
    np.testing.assert_array_equal(first.phi, again.phi)
    start = proposal(0.3, 3.0).draw(SHORT.start_points, seed=5)
    other = sample_mcmc(ToyModel(), start, SHORT, seed=8)
    assert not np.array_equal(first.phi, other.phi)


def test_walkers_never_enter_where_simulations_fail() -> None:
    limit = float(np.exp(known_mean()[0]))
    start = proposal().draw(4000, seed=1)
    start = start[start[:, 0] < limit][: MCMC.start_points]
    draws = sample_mcmc(ToyModel(fails_above=limit), start, SHORT, seed=1)
    assert draws.phi[..., 0].max() <= limit
    with pytest.raises(ValueError, match="its simulation fails"):
        sample_mcmc(ToyModel(fails_above=0.9 * start[:, 0].max()), start, SHORT, seed=1)


def test_thinned_draws_of_long_chains_are_as_good_as_independent() -> None:
    start = proposal().draw(MCMC.start_points, seed=2)
    settings = MCMC.model_copy(update={"max_steps": 8000, "min_effective_draws": 4000})
    chains = sample_mcmc(ToyModel(), start, settings, seed=3)
    phi = chains.thinned(2000, np.random.default_rng(3))
    assert phi.shape == (2000, 4)
    assert len(np.unique(phi[:, 0])) > 1990
    check_posterior(phi, 2000)


def test_walkers_start_at_draws_of_the_proposal() -> None:
    weighted = weigh(ToyModel(), proposal(), 2000, 0.1, seed=1)
    start = starting_points(ToyModel(), weighted, 128, np.random.default_rng(1))
    own = {tuple(row) for row in weighted.phi[~weighted.from_prior]}
    assert all(tuple(row) in own for row in start)
    assert len(np.unique(start, axis=0)) == 128


def test_over_dispersed_points_fill_up_where_the_proposal_fails() -> None:
    """The proposal lies where every simulation fails; the prior's draws alone have weights."""
    model = ToyModel(fails_above=float(np.exp(known_mean()[0])))
    poor = proposal(0.1, 0.0)
    poor.mean[0] += 1.0
    weighted = weigh(model, poor, 4000, 0.5, seed=1)
    assert not np.isfinite(weighted.log_likelihood[~weighted.from_prior]).any()
    start = starting_points(model, weighted, 128, np.random.default_rng(1))
    assert start.shape == (128, 4)
    assert np.isfinite(model.log_likelihood(start)).all()
    eta, weights = to_logit(weighted.phi, PRIOR), weighted.weight
    sd = np.sqrt(weights @ (eta - weights @ eta) ** 2)
    assert np.all(to_logit(start, PRIOR).std(axis=0)[1:] > 1.3 * sd[1:])
    with pytest.raises(ValueError, match="starting points for MCMC"):
        overdispersed(ToyModel(fails_above=0.0), weighted, 128, np.random.default_rng(1))


def test_settings_that_cannot_work_are_refused() -> None:
    plain = MCMC.to_plain()
    for change, message in (
        ({"walkers": 31}, "even number"),
        ({"max_steps": 100}, "less than one round"),
        ({"ensembles": 3}, "ensembles"),
    ):
        with pytest.raises(ValidationError, match=message):
            McmcSettings.from_plain({**plain, **change})


def test_walkers_that_stray_are_gathered_within_their_ensemble() -> None:
    rng = np.random.default_rng(4)
    coords = rng.standard_normal((64, 4))
    coords[[3, 20, 21]] += 9.0
    log_prob = -0.5 * (coords**2).sum(axis=1)
    state = emcee.State(coords.copy(), log_prob=log_prob.copy())
    gather(state, 4)
    changed = np.flatnonzero((state.coords != coords).any(axis=1))
    np.testing.assert_array_equal(changed, [3, 20, 21])
    for row in changed:
        own = coords[16 * (row // 16) : 16 * (row // 16 + 1)]
        assert (own == state.coords[row]).all(axis=1).any()
    np.testing.assert_allclose(state.log_prob, -0.5 * (state.coords**2).sum(axis=1))


def test_gathering_keeps_half_of_an_ensemble_however_scattered() -> None:
    coords = np.random.default_rng(5).standard_normal((32, 4)) * 100.0
    state = emcee.State(coords, log_prob=-0.5 * (coords**2).sum(axis=1))
    gather(state, 2)
    assert len(np.unique(state.coords[:16], axis=0)) == 8
    assert len(np.unique(state.coords[16:], axis=0)) == 8


def test_walkers_that_start_in_a_trap_do_not_stay_there() -> None:
    trap = 4.0
    start = proposal().draw(MCMC.start_points, seed=2)
    start[::8] *= np.exp(LOG_SD * trap)
    draws = sample_mcmc(ToyModel(trap=trap), start, MCMC, seed=3)
    assert draws.converged
    assert draws.steps == MCMC.steps
    check_posterior(draws.phi.reshape(-1, 4), draws.effective_draws.min())


@dataclass(frozen=True)
class ShiftedSpace:
    """A space in which the known posterior is normal, but off by half a standard deviation and too wide."""

    def place(self, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return u (n, 4) and log |du / dphi|."""
        eta, log_slope = LogitSpace(PRIOR).place(phi)
        return (eta - self.centre) / self.scale + 0.5, log_slope - 4 * np.log(self.scale)

    def at(self, u: np.ndarray) -> np.ndarray:
        """Return phi (n, 4)."""
        return LogitSpace(PRIOR).at((u - 0.5) * self.scale + self.centre)

    @property
    def centre(self) -> np.ndarray:
        """Of the known posterior."""
        return to_logit(np.exp(known_mean())[None], PRIOR)[0]

    @property
    def scale(self) -> float:
        """Smaller than the posterior, which is therefore wider than one."""
        return 0.6 * self.width

    @property
    def width(self) -> float:
        """Of the known posterior, in eta."""
        wide = np.exp(known_mean() + LOG_SD * np.array([-1.0, 1.0])[:, None])
        return float(np.ptp(to_logit(wide, PRIOR), axis=0).mean() / 2.0)


def sampled_in_a_shifted_space() -> McmcDraws:
    start = proposal(0.3, 3.0).draw(MCMC.start_points, seed=5)
    return sample_mcmc(ToyModel(), start, MCMC, seed=7, space=ShiftedSpace())


def test_walkers_that_a_space_places_far_out_start_elsewhere() -> None:
    class WithAFarPoint(ShiftedSpace):
        def place(self, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            u, log_slope = super().place(phi)
            return np.where(phi == far, 1e9, u), log_slope

    start = proposal(0.3, 3.0).draw(MCMC.start_points, seed=5)
    far = start[7]
    draws = sample_mcmc(ToyModel(), start, MCMC, seed=7, space=WithAFarPoint())
    assert draws.converged
    check_posterior(draws.phi.reshape(-1, 4), draws.effective_draws.min())


def test_the_sampler_finds_the_known_posterior_in_a_space_that_is_near_normal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    draws = sampled_in_a_shifted_space()
    assert draws.converged
    check_posterior(draws.phi.reshape(-1, 4), draws.effective_draws.min())

    right = NearNormal.get_proposal
    monkeypatch.setattr(
        NearNormal, "get_proposal", lambda *given: (right(*given)[0], np.zeros(len(given[1])))
    )
    wrong = sampled_in_a_shifted_space()  # steps that keep the normal distribution pull the posterior to it
    with pytest.raises(AssertionError):
        check_posterior(wrong.phi.reshape(-1, 4), wrong.effective_draws.min())


def test_steps_keep_the_standard_normal_distribution() -> None:
    """Whatever is proposed is then accepted, and stays as far from zero."""
    move, random = NearNormal(), np.random.RandomState(2)
    walkers = random.normal(size=(20000, 6))
    proposals, log_factor = move.get_proposal(walkers, [], random)
    np.testing.assert_allclose(
        log_factor, 0.5 * (proposals**2 - walkers**2).sum(axis=1), rtol=1e-12, atol=1e-12
    )
    assert (proposals**2).mean() == pytest.approx(1.0, abs=0.02)
    correlation = (walkers * proposals).mean()
    assert 0.3 < correlation < 0.9
