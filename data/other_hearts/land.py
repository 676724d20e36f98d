"""The cross-bridge law of Land et al. (2017, J Mol Cell Cardiol 106:68), in the intact human heart.

Calcium binds to troponin (``CaTRPN``), which lets tropomyosin go from its blocked state B; an unblocked
bridge is unattached (U), weakly attached and before its power stroke (W) or strongly attached (S), and both
attached states carry a mean distortion zeta. Times in s, concentrations in uM, tensions in kPa.

A wave of a millisecond finds the bridges as they are: none attaches or lets go, and all follow the stretch,
d zeta = A d lambda. So the stiffness along the fibre is h T_ref / r_s (S + W) A, :func:`bond_stiffness_kpa`.
The slope of the overlap h(lambda) is left out: more overlap is more sites for bridges that have yet to
attach, which is kinetics, and the attached ones do not feel it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import exp
from typing import Final, NamedTuple

import numpy as np

from swesbi.base.arrays import FloatArray

LONGEST: Final = 1.2  # stretch from which overlap and sensitivity grow no more (Land et al. 2017)
FULL_OVERLAP: Final = 0.87  # stretch below which thin filaments overlap each other, too
LARGEST_BLOCKING: Final = 100.0  # bound of CaTRPN^(-n/2), which has none at CaTRPN = 0
EARLIER_BEATS: Final = 4  # whose transients have not died away


@dataclass(frozen=True)
class LandParameters:
    """The parameters of Land et al. (2017), Appendix B, of the whole organ unless others are given.

    The rates of weak attachment and of the power stroke are 26 and 4 /s in skinned cells, nu and mu times as
    much in the heart. The paper's rates are per ms.
    """

    t_ref_kpa: float = 120.0
    ca50_um: float = 0.805
    n_trpn: float = 2.0
    k_trpn_per_s: float = 100.0
    trpn50: float = 0.35
    n_tm: float = 5.0
    k_u_per_s: float = 1000.0
    nu: float = 7.0
    mu: float = 3.0
    r_w: float = 0.5
    r_s: float = 0.25
    gamma_w_per_s: float = 615.0
    gamma_s_per_s: float = 8.5
    phi: float = 2.23
    a_eff: float = 25.0
    beta_0: float = 2.3
    beta_1_um: float = -2.4

    @cached_property
    def k_uw_per_s(self) -> float:
        """Rate of weak attachment."""
        return 26.0 * self.nu

    @cached_property
    def k_ws_per_s(self) -> float:
        """Rate of the power stroke."""
        return 4.0 * self.mu

    @cached_property
    def k_wu_per_s(self) -> float:
        """Rate of weak detachment, by which r_w is the weak share of U and W in balance."""
        return self.k_uw_per_s * (1.0 / self.r_w - 1.0) - self.k_ws_per_s

    @cached_property
    def k_su_per_s(self) -> float:
        """Rate of strong detachment, by which r_s is the strong share of unblocked bridges in balance."""
        return self.k_ws_per_s * self.r_w * (1.0 / self.r_s - 1.0)

    @cached_property
    def k_b_per_s(self) -> float:
        """Rate of blocking, by which half of the bridges are blocked at CaTRPN = ``trpn50``."""
        unattached = (1.0 - self.r_s) * (1.0 - self.r_w)
        return float(self.k_u_per_s * self.trpn50**self.n_tm / unattached)

    @cached_property
    def distortion(self) -> float:
        """A_w = A_s, the distortion by a quick stretch; isometric tension times ``a_eff`` is stiffness."""
        return self.a_eff * self.r_s / ((1.0 - self.r_s) * self.r_w + self.r_s)

    @cached_property
    def c_w_per_s(self) -> float:
        """Rate at which the distortion of weak bridges is forgotten."""
        return self.phi * self.k_uw_per_s * (1.0 - self.r_w) / self.r_w

    @cached_property
    def c_s_per_s(self) -> float:
        """Rate at which the distortion of strong bridges is forgotten."""
        return self.phi * self.k_ws_per_s * (1.0 - self.r_s) * self.r_w / self.r_s


class Bridges(NamedTuple):
    """The state of the law: CaTRPN, the blocked, weak and strong shares, and the two distortions."""

    ca_trpn: float
    blocked: float
    weak: float
    strong: float
    weak_distortion: float
    strong_distortion: float


RELAXED: Final = Bridges(0.02, 1.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class CalciumTransient:
    """Free calcium of a beat: Ca_0 + A (t / t_p) exp(1 - t / t_p), the form of Hunter et al.

    Hunter, McCulloch and ter Keurs (1998, Prog Biophys Mol Biol 69:289). With the values given here it
    follows what drives the intact twitch of Land et al. (2017, Fig. 6; human cells of Coppini et al. 2013,
    Circulation 127:575, at 1 Hz): 0.164 to 0.593 uM, and the time to peak that fits the whole curve.
    """

    diastolic_um: float = 0.164
    amplitude_um: float = 0.429
    time_to_peak_s: float = 0.1235
    onset_s: float = 0.0

    def at(self, time_s: float, period_s: float) -> float:
        """Return the concentration in uM, what is left of earlier beats included."""
        first = (time_s - self.onset_s) % period_s
        total = 0.0
        for beat in range(EARLIER_BEATS):
            t = (first + beat * period_s) / self.time_to_peak_s
            total += t * exp(1.0 - t)
        return self.diastolic_um + self.amplitude_um * total


def overlap(stretch: float, p: LandParameters) -> float:
    """Return h(lambda): the share of bridges that the filaments' overlap allows, 1 at lambda = 1."""
    short = min(stretch, LONGEST)
    return max(0.0, 1.0 + p.beta_0 * (short + min(short, FULL_OVERLAP) - 1.0 - FULL_OVERLAP))


def bridge_rates(
    x: Bridges, calcium_um: float, stretch: float, stretch_rate_per_s: float, p: LandParameters
) -> Bridges:
    """Return the time derivative of the state in 1/s (Land et al. 2017, Appendix A, Eqs. 47 to 57)."""
    sensitivity_um = p.ca50_um + p.beta_1_um * (min(stretch, LONGEST) - 1.0)
    binding = (calcium_um / sensitivity_um) ** p.n_trpn
    freed = max(x.ca_trpn, 1e-9) ** (0.5 * p.n_tm)
    unattached = 1.0 - x.blocked - x.weak - x.strong
    torn_weak = p.gamma_w_per_s * abs(x.weak_distortion)
    torn_strong = p.gamma_s_per_s * max(x.strong_distortion, -x.strong_distortion - 1.0, 0.0)
    return Bridges(
        p.k_trpn_per_s * (binding * (1.0 - x.ca_trpn) - x.ca_trpn),
        p.k_b_per_s * min(1.0 / freed, LARGEST_BLOCKING) * unattached - p.k_u_per_s * freed * x.blocked,
        p.k_uw_per_s * unattached - (p.k_wu_per_s + p.k_ws_per_s + torn_weak) * x.weak,
        p.k_ws_per_s * x.weak - (p.k_su_per_s + torn_strong) * x.strong,
        p.distortion * stretch_rate_per_s - p.c_w_per_s * x.weak_distortion,
        p.distortion * stretch_rate_per_s - p.c_s_per_s * x.strong_distortion,
    )


def tension_kpa(x: Bridges, stretch: float, p: LandParameters) -> float:
    """Return T_a = h T_ref / r_s ((zeta_s + 1) S + zeta_w W), in kPa of unstretched cross-section."""
    pull = (x.strong_distortion + 1.0) * x.strong + x.weak_distortion * x.weak
    return overlap(stretch, p) * p.t_ref_kpa / p.r_s * pull


def bond_stiffness_kpa(x: Bridges, stretch: float, p: LandParameters) -> float:
    """Return d T_a / d lambda of the attached bridges along the fibre: h T_ref / r_s (S + W) A, in kPa."""
    return overlap(stretch, p) * p.t_ref_kpa / p.r_s * (x.strong + x.weak) * p.distortion


def steady_tension_kpa(calcium_um: FloatArray, p: LandParameters) -> FloatArray:
    """Return the isometric tension in kPa at lambda = 1 and constant calcium of any shape.

    In balance half of the bridges are blocked at CaTRPN = ``trpn50``: T = T_ref C^n / (C^n + trpn50^n) with
    C = CaTRPN and n = ``n_tm``, where the bound ``LARGEST_BLOCKING`` is not reached.
    """
    bound = (calcium_um / p.ca50_um) ** p.n_trpn
    freed = (bound / (1.0 + bound)) ** p.n_tm
    return np.asarray(p.t_ref_kpa * freed / (freed + p.trpn50**p.n_tm))
