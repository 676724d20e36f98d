"""The noise of a cohort: two variance components pooled over its recordings, and those of each recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.stats import chi2

from swesbi.artefacts import Variable
from swesbi.noise.components import ComponentEstimate, fit_components
from swesbi.noise.levels import RepeatLevels, joined
from swesbi.recording.speed import NoiseComponents


@dataclass(frozen=True)
class NoiseEstimate:
    """Both components, from so many repeats and samples.

    Attributes:
        repeat: Between repeats, common to the samples of one.
        sample: Between the spatial samples of a repeat.
        repeats: Over the phases.
        samples: Of all repeats.
    """

    repeat: ComponentEstimate
    sample: ComponentEstimate
    repeats: Annotated[int, Variable("", "1", "repeats with accepted samples")]
    samples: Annotated[int, Variable("", "1", "accepted samples")]


@dataclass(frozen=True)
class CohortNoise:
    """Relative standard deviations of the speed over a cohort.

    Attributes:
        pooled: Components common to all recordings.
        by_subject: Those of each recording alone; for comparison, not used for standard errors.
        interval: Of all of them.
        homogeneity_p: By the likelihood ratio; NaN for one recording.
    """

    pooled: NoiseEstimate
    by_subject: Mapping[str, NoiseEstimate]
    interval: Annotated[float, Variable("", "1", "mass of the intervals")]
    homogeneity_p: Annotated[float, Variable("", "1", "p-value: all recordings share their components")]

    @property
    def components(self) -> NoiseComponents:
        """The pooled components, as a recording has its own."""
        return NoiseComponents(self.pooled.repeat.fraction, self.pooled.sample.fraction)

    @property
    def repeat_fraction(self) -> float:
        """Relative standard deviation between repeats."""
        return self.pooled.repeat.fraction

    @property
    def sample_fraction(self) -> float:
        """Relative standard deviation between samples of a repeat."""
        return self.pooled.sample.fraction


def fit_noise(recordings: Mapping[str, RepeatLevels], interval: float = 0.9) -> CohortNoise:
    """Fit a mixed model to the log speeds of a cohort by REML.

    Every phase of every subject has a mean of its own (fixed), repeats and samples are random; the
    components are common to all. Sharing them is tested by the likelihood ratio against a fit of each
    recording, chi-squared with 2 (subjects - 1) degrees of freedom.

    Args:
        recordings: Repeats of each subject's recording, by subject.
        interval: Mass of the profile-likelihood intervals.

    Raises:
        ValueError: There is no recording, or a component cannot be told; the message says of whom.
    """
    if not recordings:
        raise ValueError("there is no recording to estimate noise from")
    fits = {name: _fit_one(name, levels, interval) for name, levels in recordings.items()}
    pooled, top = _fit_one("all subjects", joined(tuple(recordings.values())), interval)
    freedom = 2 * (len(fits) - 1)
    ratio = 2.0 * (sum(own for _, own in fits.values()) - top)
    p_value = float(chi2.sf(max(ratio, 0.0), freedom)) if freedom else float(np.nan)
    by_subject = {name: estimate for name, (estimate, _) in fits.items()}
    return CohortNoise(pooled, by_subject, interval, p_value)


def _fit_one(name: str, levels: RepeatLevels, interval: float) -> tuple[NoiseEstimate, float]:
    try:
        repeat, sample, top = fit_components(levels, interval)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    return NoiseEstimate(repeat, sample, levels.repeats, levels.samples), top
