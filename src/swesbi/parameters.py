"""The inferred parameters: names, units, meanings, order, declared ranges and labels, said here alone.

theta = (k_0, k_ATP, k_SR) drives the forward model. phi = (theta, a) joins it with the passive scale a of
the recording, a nuisance parameter. Arrays of parameters have them along their last axis, in this order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

ATTAINED: Final = "attained_stiffness_kpa"
ATTAINED_SYMBOL: Final = r"$k_0(1-e^{-k_\mathrm{ATP}D_T})$"
"""Name and symbol of the attained stiffness, which the data know best of k_0 and k_ATP."""


@dataclass(frozen=True)
class Parameter:
    """One inferred parameter.

    Attributes:
        name: Name in configuration, artefacts and tables; it ends in the unit.
        unit: Unit in plain text.
        meaning: What it is, in words, before its symbol.
        tex: Symbol in TeX, for figures and LaTeX tables.
        html: Symbol in HTML, for the page.
        text: Symbol in plain text, for Markdown and the terminal.
        si: What a value is multiplied by for SI units.
        declared: Range in which the forward model is declared, in ``unit``; a prior lies within.
        title: What figures call it before its symbol, if anything.
    """

    name: str
    unit: str
    meaning: str
    tex: str
    html: str
    text: str
    si: float = 1.0
    declared: tuple[float, float] = (0.0, math.inf)
    title: str = ""

    @property
    def label(self) -> str:
        """Title, symbol and unit in TeX, for an axis or a row."""
        unit = f"{self.unit.removeprefix('1/')}$^{{-1}}$" if self.unit.startswith("1/") else self.unit
        return f"{self.title} {self.tex} ({unit})".strip()

    @property
    def cf_unit(self) -> str:
        """The unit as artefacts say it, by the CF conventions: a reciprocal as a power."""
        return f"{self.unit.removeprefix('1/')}-1" if self.unit.startswith("1/") else self.unit

    @property
    def html_unit(self) -> str:
        """The unit on the page: a reciprocal as a power."""
        return f"{self.unit.removeprefix('1/')}⁻¹" if self.unit.startswith("1/") else self.unit


# Declared ranges: an order of magnitude beyond published parameters of myocardium (Marchesseau et al. 2013;
# Banus et al. 2021), so that any prior of a study fits inside, yet a wrong unit does not.
THETA: Final = (
    Parameter(
        "k0_kpa", "kPa", "active stiffness scale", "$k_0$", "<i>k</i><sub>0</sub>", "k_0",
        si=1e3, declared=(1.0, 500.0),
    ),
    Parameter(
        "k_atp_per_s", "1/s", "contraction rate", r"$k_\mathrm{ATP}$", "<i>k</i><sub>ATP</sub>", "k_ATP",
        declared=(0.1, 500.0),
    ),
    Parameter(
        "k_sr_per_s", "1/s", "relaxation rate", r"$k_\mathrm{SR}$", "<i>k</i><sub>SR</sub>", "k_SR",
        declared=(0.1, 300.0),
    ),
)  # fmt: skip
"""The active parameters: stiffness scale, contraction rate and relaxation rate."""
PASSIVE_SCALE: Final = Parameter(
    "passive_scale_kpa", "kPa", "passive scale", "$a$", "<i>a</i>", "a", si=1e3, title="passive scale"
)
PHI: Final = (*THETA, PASSIVE_SCALE)
"""All that is inferred from speeds: theta, and the passive scale last."""
OF_THETA: Final = slice(len(THETA))
SCALE: Final = len(THETA)
"""Where theta and the passive scale stand in phi."""

THETA_NAMES: Final = tuple(parameter.name for parameter in THETA)
THETA_UNITS: Final = tuple(parameter.unit for parameter in THETA)
THETA_LABELS: Final = tuple(parameter.label for parameter in THETA)
THETA_SYMBOLS: Final = tuple(parameter.tex for parameter in THETA)
THETA_SI: Final = tuple(parameter.si for parameter in THETA)
THETA_RANGES: Final = tuple(parameter.declared for parameter in THETA)
THETA_COLUMNS: Final = ", ".join(parameter.cf_unit for parameter in THETA)
PHI_COLUMNS: Final = ", ".join(parameter.cf_unit for parameter in PHI)
"""Units of the columns of theta and of phi, as artefacts say them."""
PHI_NAMES: Final = tuple(parameter.name for parameter in PHI)
K_0, K_ATP = (THETA_NAMES.index(name) for name in ("k0_kpa", "k_atp_per_s"))
"""Where the two parameters of the attained stiffness stand."""
PHI_LABELS: Final = tuple(parameter.label for parameter in PHI)
PHI_SYMBOLS: Final = {parameter.name: parameter.tex for parameter in PHI}
"""Symbols in TeX by name."""
