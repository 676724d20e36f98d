"""The bank of a planned study: simulated persons, answered with the effect and without it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from swesbi.artefacts import Artefact, Labels, Variable
from swesbi.base.arrays import FloatArray, below_each_other, rows_of

NONE: Final = "none"
EFFECT: Final = "effect"
ARMS: Final = (NONE, EFFECT)
"""Without the effect and with it, of every person."""


@dataclass(frozen=True)
class Bank(Artefact, kind="plan_bank"):
    """Persons of a bank, N of them, in both arms.

    What is inferred of a person is kept as a normal summary: mean and covariance of the logarithms of the
    draws, of the ratio of both visits or of theta.
    """

    arm: Annotated[tuple[str, ...], Labels("arm")]
    number: Annotated[FloatArray, Variable("person", "1", "number of the person")]
    mean: Annotated[
        FloatArray, Variable("person arm parameter", "1", "posterior mean of the logarithm of ratio or theta")
    ]
    covariance: Annotated[
        FloatArray, Variable("person arm parameter other_parameter", "1", "its posterior covariance")
    ]
    truth: Annotated[FloatArray, Variable("person arm parameter", "as asked", "true ratio, or theta")]
    risen: Annotated[
        FloatArray,
        Variable("person arm parameter", "1", "probability of a rise beyond the threshold; NaN of one visit"),
    ]
    fallen: Annotated[
        FloatArray,
        Variable("person arm parameter", "1", "probability of a fall beyond the threshold; NaN of one visit"),
    ]
    detectable: Annotated[
        FloatArray,
        Variable("person arm parameter", "1", "smallest change that can be detected; NaN of one visit"),
    ]
    efficiency: Annotated[FloatArray, Variable("person arm", "1", "effective share of the weighted draws")]
    converged: Annotated[FloatArray, Variable("person arm", "1", "1 where draws are reliable, else 0")]
    redrawn: Annotated[FloatArray, Variable("person", "1", "persons drawn before who did not take part")]

    def before(self, number: int) -> Bank:
        """Return the persons whose number is below this."""
        return rows_of(self, self.number < number)


def bank_of(parts: Sequence[Bank]) -> Bank:
    """Return the persons of several banks, at least one, in the order of their numbers."""
    whole = below_each_other(parts)
    return rows_of(whole, np.argsort(whole.number, kind="stable"))
