"""Do two observed frequencies differ by more than their binomial errors?"""

from __future__ import annotations

import numpy as np

NORMAL_95: float = 1.96


def differ(one: float, trials: float, other: float, other_trials: float) -> bool:
    """Return whether two frequencies differ by more than 1.96 standard errors of their difference.

    The errors are those of the Agresti-Caffo interval (2000), which adds one success and one failure to
    each sample, so that a frequency of 0 or 1 has an error too.

    Args:
        one: Observed frequency, from 0 to 1.
        trials: Trials behind it.
        other: Another frequency.
        other_trials: Trials behind that.
    """
    first, second = _adjusted(one, trials), _adjusted(other, other_trials)
    error = np.sqrt(first * (1.0 - first) / (trials + 2) + second * (1.0 - second) / (other_trials + 2))
    return bool(abs(first - second) > NORMAL_95 * error)


def _adjusted(frequency: float, trials: float) -> float:
    return (frequency * trials + 1.0) / (trials + 2.0)
