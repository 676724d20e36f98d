"""A move for emcee that advances several ensembles together, each on its own."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
State = Any  # emcee.State: coords (walkers, d), log_prob (walkers,)


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
        for moving, still in ((first, second), (second, first)):
            self._move_half(model, state, moving, still, accepted)
        return state, accepted

    def _halves(
        self, walkers: int, random: np.random.RandomState
    ) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
        """Return walkers of two random halves of each ensemble; (ensembles, walkers of it / 2) each."""
        size = walkers // self._ensembles
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
        log_prob, _ = model.compute_log_prob_fn(coords)
        rows = moving.ravel()
        taken = log_factor + log_prob - state.log_prob[rows] > np.log(model.random.rand(len(rows)))
        state.coords[rows[taken]] = coords[taken]
        state.log_prob[rows[taken]] = log_prob[taken]
        accepted[rows] = taken
