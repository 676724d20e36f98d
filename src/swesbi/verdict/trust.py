"""How far each line of an answer can be relied on, and what it is conditional on.

What holds whatever the structure of the heart comes first, then what holds under conditions, then parameters
of this model. Coverage over hearts of other equations is in ``studies/validation/tables``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

from swesbi.parameters import TOLD, Parameter

Trust = Literal["over structures", "conditional", "of this model"]
IN_WORDS: Final[Mapping[Trust, str]] = {
    "over structures": "to be relied on over structures of the heart",
    "conditional": "conditional",
    "of this model": "parameters of this model",
}


@dataclass(frozen=True)
class Told:
    """One line of an answer.

    Attributes:
        parameter: The quantity.
        trust: How far it can be relied on.
        condition: What it is conditional on, in words.
    """

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
    "decay_rate_per_s": ("conditional", "a passive part and bonds that the model can be"),
    "half_relaxation_ms": ("conditional", "what the decay rate is conditional on"),
    "k_sr_per_s": ("conditional", "bonds that relax at one rate, and a passive law within the prior"),
    "shown_kpa": ("conditional", "a passive law within the prior, and the scale of the speeds"),
    "passive_stiffness_kpa": ("conditional", "late diastole being passive, and the scale of the speeds"),
    "k0_kpa": ("of this model", "its bonds, since other equations call the same muscle by another number"),
    "k_atp_per_s": ("of this model", "its bonds and its activation"),
    "bonds_kpa": ("of this model", "bonds that show all their stiffness, with no spring in series"),
}
ANSWER: Final = tuple(Told(parameter, *_CONDITIONS[parameter.name]) for parameter in TOLD)
"""The lines of an answer, in their order."""
