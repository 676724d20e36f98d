"""The noise of the measured speeds, estimated from the repeats of the whole cohort by a mixed model."""

from swesbi.noise.cohort import CohortNoise, NoiseEstimate, fit_noise
from swesbi.noise.components import ComponentEstimate
from swesbi.noise.error import relative_se
from swesbi.noise.levels import RepeatLevels, repeat_levels

__all__ = [
    "CohortNoise",
    "ComponentEstimate",
    "NoiseEstimate",
    "RepeatLevels",
    "fit_noise",
    "relative_se",
    "repeat_levels",
]
