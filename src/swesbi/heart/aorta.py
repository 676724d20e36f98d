"""The pressure at the root of the aorta, which a cuff on the arm stands for."""

from __future__ import annotations

from swesbi.base.arrays import FloatArray
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import ML_PER_M3, PA_PER_MMHG, Beats


def aortic_pressure_mmhg(beats: Beats, settings: ForwardModelSettings) -> FloatArray:
    """Return the pressure behind the aortic valve along each beat, P_s + R_p Q_ao; shape (n, M).

    The recorded arterial pressure P_s is that of the capacitance behind the proximal resistance, tens of
    mmHg below in systole. A proximal capacitance is left out here: it smooths by R_p C_p, a millisecond.
    """
    resistance_mmhg_s_ml = settings.proximal_resistance_pa_s_m3 / PA_PER_MMHG / ML_PER_M3
    pressure: FloatArray = beats.arterial_pressure_mmhg + resistance_mmhg_s_ml * beats.aortic_flow_ml_s
    return pressure
