"""The verdict on one subject in a few words, whichever experiment gave it."""

from __future__ import annotations

from typing import Final

from swesbi.evaluation.support_numbers import support_numbers
from swesbi.inference.support import Support, SupportTest

SUPPORTED: Final = "supported"
STRAINED: Final = "strained"
UNSUPPORTED: Final = "unsupported"
STATUSES: Final = (SUPPORTED, STRAINED, UNSUPPORTED)
SHOWN_TESTS: Final = 3
TEST_LABELS: Final = {
    "chi2": "χ²",
    "mmd": "MMD",
    "mahalanobis": "Mahalanobis",
    "conditional_features": "conditional features",
    "boundary_mass": "mass at a bound",
    "context_leave_one_out": "context of the others",
    "context_ranges": "context range",
}


def is_exact(support: Support) -> bool:
    """Return whether the posterior is that of an exact likelihood, of an experiment on speeds."""
    return support.status is not None


def status(support: Support) -> str:
    """Return supported, strained or unsupported; an experiment on features knows the first and the last."""
    if support.status is not None:
        return support.status
    return SUPPORTED if support.supported else UNSUPPORTED


def verdict_numbers(support: Support, shown: int = SHOWN_TESTS) -> tuple[str, ...]:
    """Return what decided, in short lines: ``shown`` flagged tests, or the two criteria of prior support."""
    if not is_exact(support):
        return support_numbers(support)
    flagged = sorted((test for test in support.tests if test.flagged), key=_evidence)
    lines = tuple(map(_short, flagged))
    more = len(lines) - shown
    return lines if more < 2 else (*lines[:shown], f"and {more} more")


def weights_in_words(support: Support) -> str:
    """Return how the importance weights did: "k-hat 0.35, efficiency 81 %"."""
    shape = "inf" if support.k_hat is None else f"{support.k_hat:.2f}"
    share = "" if support.efficiency is None else f", efficiency {100.0 * support.efficiency:.0f} %"
    return f"k-hat {shape}{share}"


def sampler_in_words(support: Support) -> str:
    """Return what gave the exact draws: "importance weights" or "MCMC"."""
    return "MCMC" if support.sampler == "mcmc" else "importance weights"


def label_of_test(name: str) -> str:
    """Return a test's name in words: "time_to_peak" as "time to peak"."""
    return TEST_LABELS.get(name, name.replace("_", " "))


def _evidence(test: SupportTest) -> float:
    """Order tests by how strongly they speak, those without a p-value first."""
    return -1.0 if test.p_value is None else test.p_value


def _short(test: SupportTest) -> str:
    if test.p_value is None:
        return label_of_test(test.name)
    small = test.p_value < 0.001
    return f"{label_of_test(test.name)}, p {'< 0.001' if small else f'= {test.p_value:.3f}'}"
