"""How far each line of an answer can be relied on, and what it is conditional on.

What at least 85 % of the intervals contain in hearts of each other structure comes first, then what holds
under conditions, parameters of this model last. Coverage over hearts of other equations is in
``studies/validation/tables``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

from swesbi.parameters import ISOMETRIC, REPORTED, Parameter

Trust = Literal["over structures", "conditional"]
IN_WORDS: Final[Mapping[Trust, str]] = {
    "over structures": "hardly depends on the heart model",
    "conditional": "valid only if",
}


@dataclass(frozen=True)
class AnswerLine:
    """One line of an answer: a quantity, how far it can be relied on, and under what condition, in words."""

    parameter: Parameter
    trust: Trust
    condition: str

    @property
    def short(self) -> str:
        """What the quantity is called where there is little room."""
        return self.parameter.title or self.parameter.meaning


_CONDITIONS: Final[Mapping[str, tuple[Trust, str]]] = {
    "duration_ms": ("over structures", "the phases and the quality control of the recording"),
    "peak_kpa": (
        "over structures",
        "the scale of the speeds, which enters twice, so compare within one protocol",
    ),
    "late_diastole_kpa": ("over structures", "the scale of the speeds, as the peak"),
    "decay_rate_per_s": ("conditional", "the passive part and the bonds are ones that the model can be"),
    "half_active_ms": ("conditional", "the decay rate is valid"),
    "k_sr_per_s": ("conditional", "bonds relax at one rate, and the passive law is within the prior"),
    "peak_active_kpa": ("conditional", "the passive law and the scale of the speeds are within the prior"),
    "active_share": ("conditional", "the passive law is within the prior"),
    "passive_stiffness_kpa": (
        "conditional",
        "late diastole is passive, and the scale of the speeds is within the prior",
    ),
    ISOMETRIC: ("conditional", "bonds and the duration of activation are the model's"),
    "k0_kpa": (
        "conditional",
        "bonds are the model's; other equations call the same muscle by another number",
    ),
    "k_atp_per_s": ("conditional", "bonds and activation are the model's"),
}
ANSWER_LINES: Final = tuple(AnswerLine(parameter, *_CONDITIONS[parameter.name]) for parameter in REPORTED)
"""The lines of an answer, in their order."""
