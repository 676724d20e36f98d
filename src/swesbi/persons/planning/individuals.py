"""What a protocol says of one person: whose change is called, rightly and wrongly, what can be detected."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swesbi.persons.planning.asked import Effect
from swesbi.persons.planning.bank import ARMS, EFFECT, NONE, Bank


@dataclass(frozen=True)
class OnePersonPower:
    """The rule of `changes.rule` on the persons of a bank.

    Attributes:
        called: Share of those with the effect whose own change is called, in its direction.
        wrongly: Share of those without it of whom one is called, in any direction.
        detectable: Median over persons of the smallest change that can be detected, as a fraction.
        persons: Behind these.
    """

    called: float
    wrongly: float
    detectable: float
    persons: int


def one_person_power(bank: Bank, effect: Effect, probability: float) -> OnePersonPower | None:
    """Return what the protocol says of one person; None where persons came once.

    Args:
        bank: The persons.
        effect: What has happened to them.
        probability: Of a change beyond the threshold, above which one is called (``changes.rule``).
    """
    with_effect, without = ARMS.index(EFFECT), ARMS.index(NONE)
    if np.isnan(bank.risen).any():
        return None
    right = (bank.risen if effect.rises else bank.fallen)[with_effect, :, effect.number]
    either = np.maximum(bank.risen, bank.fallen)[without, :, effect.number]
    return OnePersonPower(
        called=float((right > probability).mean()),
        wrongly=float((either > probability).mean()),
        detectable=float(np.median(bank.detectable[with_effect, :, effect.number])),
        persons=len(bank.number),
    )
