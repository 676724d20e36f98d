"""Moves of MCMC: emcee's, for ensembles side by side, and one where posteriors are near normal."""

from __future__ import annotations

from typing import Any, Final, Protocol

import emcee
import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import FloatArray

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
    shares = [
        (emcee.moves.DEMove(sigma=GAMMA_SD), 1.0 - JUMP_SHARE - STRETCH_SHARE),
        (emcee.moves.DEMove(sigma=GAMMA_SD, gamma0=1.0), JUMP_SHARE),
        (emcee.moves.StretchMove(), STRETCH_SHARE),
    ]
    if near_normal:
        shares = [(move, (1.0 - NORMAL_SHARE) * share) for move, share in shares]
        shares.append((NearNormal(), NORMAL_SHARE))
    return [(SideBySide(move, ensembles), share) for move, share in shares]
