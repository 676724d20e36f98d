"""Does one recording have the noise of a cohort that it is no part of?"""

from __future__ import annotations

from dataclasses import dataclass

from scipy.stats import chi2

from swesbi.noise.components import fit_components, log_restricted_likelihood
from swesbi.noise.levels import RepeatLevels
from swesbi.recording.speed import NoiseComponents


@dataclass(frozen=True)
class NoiseComparison:
    """One recording's noise beside the cohort's.

    Attributes:
        own: REML components of the recording alone.
        statistic: Likelihood ratio, twice the log of it.
        p_value: Of the ratio, chi-squared with two degrees of freedom.
    """

    own: NoiseComponents
    statistic: float
    p_value: float


def compare_noise(levels: RepeatLevels, cohort: NoiseComponents, interval: float = 0.9) -> NoiseComparison:
    """Test by the restricted likelihood ratio that a recording has the cohort's components.

    The cohort's own uncertainty is left out, as it is where its components give the standard errors.

    Args:
        levels: Repeats of the recording.
        cohort: The cohort's components.
        interval: Mass of the intervals that are fitted along the way.

    Raises:
        ValueError: A component of the recording cannot be told.
    """
    repeat, sample, top = fit_components(levels, interval)
    given = log_restricted_likelihood(levels, cohort.repeat_fraction, cohort.sample_fraction)
    ratio = max(0.0, 2.0 * (top - given))
    own = NoiseComponents(repeat.fraction, sample.fraction)
    return NoiseComparison(own, ratio, float(chi2.sf(ratio, 2)))
