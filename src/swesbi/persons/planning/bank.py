"""The bank of a planned study: simulated persons, answered with the effect and without it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from swesbi.artefacts import Artefact, Labels, Variable
from swesbi.base.arrays import FloatArray

NONE: Final = "none"
EFFECT: Final = "effect"
ARMS: Final = (NONE, EFFECT)
"""Without the effect and with it, of every person."""
BY_ARM: Final = ("values", "truth", "risen", "fallen", "detectable", "efficiency", "converged")
"""What is kept of each person in both arms."""


@dataclass(frozen=True)
class BankPerson:
    """One person of a bank, in both arms (without the effect, with it).

    Attributes:
        number: Of the person.
        values: Equally weighted draws of what is recycled: ratios of both visits, or theta; shape (2, n, 3).
        truth: Its true values; shape (2, 3).
        risen: Probability of a rise beyond the threshold of the rule; NaN of one visit; shape (2, 3).
        fallen: Of a fall; likewise.
        detectable: Smallest change that the rule can detect in this person; likewise.
        efficiency: Effective share of the weighted draws; shape (2,).
        converged: Whether weights or sampler are reliable; shape (2,).
        redrawn: Persons who were drawn in this place before and did not take part.
    """

    number: int
    values: FloatArray
    truth: FloatArray
    risen: FloatArray
    fallen: FloatArray
    detectable: FloatArray
    efficiency: FloatArray
    converged: FloatArray
    redrawn: int


@dataclass(frozen=True)
class Bank(Artefact, kind="plan_bank"):
    """Persons of a bank, N of them; attributes as of :class:`BankPerson`."""

    arm: Annotated[tuple[str, ...], Labels("arm")]
    number: Annotated[FloatArray, Variable("person", "1", "number of the person")]
    values: Annotated[
        FloatArray, Variable("arm person draw parameter", "as asked", "draws: ratios of two visits, or theta")
    ]
    truth: Annotated[FloatArray, Variable("arm person parameter", "as asked", "true ratio, or theta")]
    risen: Annotated[
        FloatArray, Variable("arm person parameter", "1", "probability of a rise beyond the threshold")
    ]
    fallen: Annotated[
        FloatArray, Variable("arm person parameter", "1", "probability of a fall beyond the threshold")
    ]
    detectable: Annotated[
        FloatArray, Variable("arm person parameter", "1", "smallest change that can be detected")
    ]
    efficiency: Annotated[FloatArray, Variable("arm person", "1", "effective share of the weighted draws")]
    converged: Annotated[FloatArray, Variable("arm person", "1", "1 where draws are reliable, else 0")]
    redrawn: Annotated[FloatArray, Variable("person", "1", "persons drawn before who did not take part")]

    @property
    def persons(self) -> tuple[BankPerson, ...]:
        """Each person by themselves."""
        return tuple(
            BankPerson(
                number=int(self.number[d]),
                redrawn=int(self.redrawn[d]),
                **{name: getattr(self, name)[:, d] for name in BY_ARM},
            )
            for d in range(len(self.number))
        )

    def of_arm(self, arm: str) -> FloatArray:
        """Return the draws (N, n, 3) of one arm."""
        return np.asarray(self.values[ARMS.index(arm)])


def bank_of(persons: Sequence[BankPerson]) -> Bank:
    """Return persons in the order of their numbers."""
    ordered = sorted(persons, key=lambda one: one.number)

    def stacked(name: str) -> FloatArray:
        return np.stack([getattr(one, name) for one in ordered], axis=1)

    return Bank(
        arm=ARMS,
        number=np.array([float(one.number) for one in ordered]),
        redrawn=np.array([float(one.redrawn) for one in ordered]),
        **{name: stacked(name) for name in BY_ARM},
    )
