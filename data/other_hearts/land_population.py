"""Hearts of letter f: the bridges of Land et al. (2017), no two alike, in contexts of the population."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from data.other_hearts.drawn import Drawn
from data.other_hearts.land import CalciumTransient, LandParameters
from data.other_hearts.land_heart import LandHeart, land_beat
from studies.validation.hearts.beat import Beat
from studies.validation.hearts.ranges import log_uniform
from swesbi.context import Context
from swesbi.heart.settings import ForwardModelSettings
from swesbi.parameters import THETA_NAMES
from swesbi.virtual.generated import PHYSIOLOGY, Range
from swesbi.virtual.volunteers import PASSIVE_C0_PA, PASSIVE_C2_PA

LETTER: Final = "f"
VARIED: Final[Range] = (0.8, 1.25)
"""Of each drawn parameter of bridges and calcium over the published value, uniform in its logarithm."""
BRIDGES: Final = ("t_ref_kpa", "ca50_um", "k_trpn_per_s", "k_u_per_s", "nu", "mu")
CALCIUM: Final = ("amplitude_um", "time_to_peak_s")
REFERENCE_PERIOD_S: Final = 1.0  # of the published transient
ONSET_S: Final[Range] = (0.010, 0.030)
"""Rise of calcium after the R peak; chosen, so that tension follows when the model's activation begins."""
WALL: Final = ("wall_stiffness", "distal_resistance_pa_s_m3", "systemic_capacitance_m3_pa")
"""Of wall and circulation, as the generated cohort has them."""
WAVE_SHARE: Final = 1.0 / 70.0
"""Share of the bonds' stiffness along the fibre that the apparent modulus 3 rho c^2 of a shear wave shows.

At the published parameters the bonds attain 2.3 to 3.0 MPa along the fibre in contexts of the population:
``a_eff`` times the isometric tension, as quick stretches of muscle show. A shear wave hardly strains the
fibre along itself: septa at their stiffest show 2.1 to 5.5 m/s (README of the virtual volunteers), 13 to
91 kPa, and 35 kPa in the geometric mean, a seventieth.
"""
WAVE_SPREAD: Final[Range] = (1.0 / 1.5, 1.5)  # chosen: angle of fibre and wave differ between hearts
# What a person can have: failure is severe below 0.30 (Lang et al. 2015), thick walls eject above 0.75.
EJECTION_FRACTION: Final[Range] = (0.15, 0.85)
SYSTOLIC_MMHG: Final[Range] = (60.0, 200.0)


@dataclass(frozen=True)
class LandHearts:
    """Where the hearts come from; geometry, wall, valves and circulation are given, but for what is drawn."""

    forward_model: ForwardModelSettings

    @property
    def letter(self) -> str:
        """Its letter."""
        return LETTER

    @property
    def settings(self) -> dict[str, Any]:
        """What a heart depends on besides its draws and the population."""
        return {"forward_model": self.forward_model.to_plain()}

    def draw(self, context: Context, rng: np.random.Generator) -> Drawn:
        """Draw bridges, calcium, wall, circulation, and the share that the wave meets."""
        published = {name: getattr(LandParameters(), name) for name in BRIDGES}
        published |= {f"calcium_{name}": getattr(_calcium(context), name) for name in CALCIUM}
        own = {name: value * log_uniform(VARIED, rng) for name, value in published.items()}
        own["calcium_onset_s"] = float(rng.uniform(*ONSET_S))
        own |= {name: float(rng.uniform(*PHYSIOLOGY[name])) for name in WALL}
        own["wave_share"] = WAVE_SHARE * log_uniform(WAVE_SPREAD, rng)
        return Drawn(np.full(len(THETA_NAMES), np.nan), own)

    def beat(self, context: Context, drawn: Drawn) -> Beat:
        """Return the periodic beat of a heart; a RuntimeError where it has none."""
        return land_beat(land_heart_of(context, drawn.own, self.forward_model), context)

    def refusal(self, beat: Beat) -> str:
        """Say why a beat is no person's: its ejection fraction or its systolic pressure."""
        return _outside("ejection fraction", beat.ejection_fraction, EJECTION_FRACTION) or _outside(
            "systolic pressure in mmHg", float(beat.arterial_mmhg.max()), SYSTOLIC_MMHG
        )


def _outside(what: str, value: float, limits: Range) -> str:
    low, high = limits
    return "" if low <= value <= high else f"{what} {value:.2f} is outside {low:g} to {high:g}"


def _calcium(context: Context) -> CalciumTransient:
    """Return the published transient, scaled with the root of the period as the model's activation is."""
    published = CalciumTransient()
    stretched = float(np.sqrt(context.period_s / REFERENCE_PERIOD_S))
    return replace(published, time_to_peak_s=stretched * published.time_to_peak_s)


def land_heart_of(
    context: Context, own: Mapping[str, float], forward_model: ForwardModelSettings
) -> LandHeart:
    """Return the heart that has these parameters."""
    calcium = {name: own[f"calcium_{name}"] for name in (*CALCIUM, "onset_s")}
    changes = {
        "passive_c0_pa": PASSIVE_C0_PA * own["wall_stiffness"],
        "passive_c2_pa": PASSIVE_C2_PA * own["wall_stiffness"],
        "distal_resistance_pa_s_m3": own["distal_resistance_pa_s_m3"],
        "systemic_capacitance_m3_pa": own["systemic_capacitance_m3_pa"],
    }
    return LandHeart(
        law=LandParameters(**{name: own[name] for name in BRIDGES}),
        calcium=replace(_calcium(context), **calcium),
        wave_share=own["wave_share"],
        settings=ForwardModelSettings.from_plain(forward_model.to_plain() | changes),
    )
