"""Checks made without a network: posteriors from one bank of simulations weighted by the likelihood."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import speed_case
from numpy.typing import NDArray

from swesbi.base.arrays import below_each_other
from swesbi.measurement.likelihood import draw_speeds, log_likelihood
from swesbi.measurement.speeds import PredictedSpeeds
from swesbi.prior import quantile
from swesbi.verdict.nulls import Misfits, misfits_of

FloatArray = NDArray[np.float64]
BANK = 6000
DRAWS = 200
RELATIVE_SE = 0.12


class Bank:
    """Prior simulations, simulated once, weighted to the posterior of any recording.

    The recordings are noisier than real ones, so that many simulations share the posterior.
    """

    def __init__(self) -> None:
        quiet = speed_case.model()
        recording = replace(quiet.recording, relative_se=np.full(len(quiet.recording.phase), RELATIVE_SE))
        self.model = replace(quiet, recording=recording)
        self.phi, self.predicted = self._simulate(BANK, 1)

    def clean(self, count: int, seed: int) -> PredictedSpeeds:
        """Return noiseless speeds of phi from the prior that are not in the bank."""
        return self._simulate(count, seed)[1]

    def recordings(self, count: int, seed: int, noise: float = 1.0) -> FloatArray:
        """Draw speeds (count, p) of recordings, well-specified if ``noise`` is one."""
        clean, rng = self.clean(count, seed), np.random.default_rng(seed + 1)
        noisy = draw_speeds(clean, self.model.recording.errors, self.model.settings.discrepancy, rng)
        return np.asarray(np.exp(clean.log_speed + noise * (np.log(noisy) - clean.log_speed)))

    def _simulate(self, count: int, seed: int) -> tuple[FloatArray, PredictedSpeeds]:
        phi = quantile(np.random.default_rng(seed).random((count, 4)), self.model.settings.prior)
        return phi, self.model.predict(phi)

    def check(self, speeds: FloatArray, seed: int) -> Misfits:
        """Check recordings (n, p) under posteriors from all simulations, weighted by the exact likelihood."""
        return below_each_other([self._check(row, seed + i) for i, row in enumerate(speeds)])

    def _check(self, speeds: FloatArray, seed: int) -> Misfits:
        model = replace(self.model, recording=replace(self.model.recording, speed_m_s=speeds))
        log_weight = log_likelihood(self.predicted, model.recording, model.settings.discrepancy)
        weight = np.exp(log_weight - log_weight.max())
        rows = np.random.default_rng(seed).choice(len(weight), DRAWS, p=weight / weight.sum())
        weights, rng = np.full(DRAWS, 1 / DRAWS), np.random.default_rng(seed)
        return misfits_of(model, self.phi[rows], weights, self.predicted.rows(rows), rng)
