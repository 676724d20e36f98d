"""The noise of the recordings of one folder: estimated from its own repeats, shrunk towards what is expected.

The components have log-normal priors. With the restricted likelihood of all repeats of the folder these give
the most probable components. Of many recordings the data decide, of one recording what its repeats do not
tell is as the prior has it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

import numpy as np
from scipy.special import chdtrc

from swesbi.base.arrays import FloatArray
from swesbi.recording.noise.cohort import NoiseComparison, compare_noise, together
from swesbi.recording.noise.components import RepeatLevels
from swesbi.recording.noise.sweeps import SweepLevels
from swesbi.recording.settings import OTHERS, NoisePriorSettings
from swesbi.recording.speed import NoiseComponents

LIMITS: Final = (1.0e-4, 0.5)
"""Of a component; a search that ends there is one in which nothing was measured."""
MANY: Final = 20
"""Recordings of which one moves the estimate of a component by a few per cent at most."""


@dataclass(frozen=True)
class FolderNoise:
    """The most probable noise of so many recordings of one kind of repeats; of none: the prior's medians."""

    components: NoiseComponents
    recordings: int

    @property
    def in_words(self) -> str:
        """The components, and what they are estimated from."""
        own = self.components
        parts = f"{own.repeat_fraction:.1%} between repeats, {own.sample_fraction:.1%} between samples"
        if own.sweep_fraction:
            parts += f", {own.sweep_fraction:.1%} between sweeps"
        if self.recordings == 0:
            return f"{parts}: as is expected of a laboratory that nobody has seen"
        few = "one recording, shrunk towards what is expected" if self.recordings == 1 else ""
        return f"{parts}: of {few or f'{self.recordings} recordings of the folder'}"


def folder_noise(recordings: Sequence[RepeatLevels], prior: NoisePriorSettings) -> FolderNoise:
    """Return the noise of a folder: the mode of prior times restricted likelihood, over log components.

    Its recordings are all of sweeps or none.
    """
    if not recordings:
        return FolderNoise(_median(prior), 0)
    from scipy.optimize import minimize

    levels = together(recordings)
    centre = np.log(list(vars(_median(prior)).values())[: len(levels.names)])

    def surprise(log_sd: FloatArray) -> float:
        distance = (log_sd - centre) / prior.log_sd
        noise = NoiseComponents(*np.exp(log_sd).tolist())
        return float(0.5 * distance @ distance - levels.log_likelihood(noise))

    bounds = [tuple(np.log(LIMITS))] * len(centre)
    found = minimize(surprise, centre, method="L-BFGS-B", bounds=bounds, options={"ftol": 1.0e-12})
    return FolderNoise(NoiseComponents(*np.exp(found.x).tolist()), len(recordings))


def _median(prior: NoisePriorSettings) -> NoiseComponents:
    return NoiseComponents(prior.repeat_fraction, prior.sample_fraction, prior.sweep_fraction)


@dataclass(frozen=True)
class FolderRecordings:
    """The repeats of a folder's recordings, by subject, with the noise that they have together.

    ``groups`` has the group of each subject whose noise is estimated apart.
    """

    levels: Mapping[str, RepeatLevels]
    prior: NoisePriorSettings
    groups: Mapping[str, str] = field(default_factory=dict)

    def noise(self, subject: str) -> FolderNoise:
        """Return the noise of all recordings of the subject's group and kind of repeats, its own too."""
        return self._by_kind[self._kind(subject)]

    @cached_property
    def _by_kind(self) -> dict[tuple[str, bool], FolderNoise]:
        """The noise of each group's sweeps, and of its separate repeats."""
        kinds = dict.fromkeys(map(self._kind, self.levels))
        return {kind: folder_noise(self._of_kind(kind), self.prior) for kind in kinds}

    def _kind(self, subject: str) -> tuple[str, bool]:
        return self.groups.get(subject, OTHERS), isinstance(self.levels[subject], SweepLevels)

    def _of_kind(self, kind: tuple[str, bool], but: str = "") -> list[RepeatLevels]:
        return [own for name, own in self.levels.items() if name != but and self._kind(name) == kind]

    def compared(self, subject: str) -> NoiseComparison | None:
        """Test by the restricted likelihood ratio that a recording has the noise of the others, if any.

        The ratio is that of two sets of components to one. Where the others are ``MANY``, one recording
        hardly moves what is estimated from all, and all stand for them.
        """
        own, noise = self.levels[subject], self.noise(subject)
        if noise.recordings < 2:
            return None
        alone = compare_noise(own, noise.components)
        if noise.recordings > MANY:
            return alone
        others = self._of_kind(self._kind(subject), but=subject)
        apart, rest = folder_noise(others, self.prior).components, together(others)
        gained = rest.log_likelihood(apart) - rest.log_likelihood(noise.components)
        ratio = alone.statistic + max(0.0, 2.0 * gained)
        return NoiseComparison(alone.own, ratio, float(chdtrc(len(own.names), ratio)))
