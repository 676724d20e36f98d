"""The schema of the training set of experiments on measured speeds."""

from typing import Final

from swesbi.artefacts.variable import Variable

SIMULATED = ("subject", "simulation", "phase")

SCHEMAS: Final = {
    "speed_pool": {
        "/": {
            "phase": Variable(("subject", "phase"), "1", "phases of the recording, fraction of the cycle"),
            "measured": Variable(("subject", "phase"), "1", "1 measured, 0 missing"),
            "theta": Variable(("subject", "simulation", "parameter"), "kPa, s-1, s-1", "prior draws"),
            "active_stiffness_kpa": Variable(SIMULATED, "kPa", "active stiffness at the measured phases"),
            "active_slope_kpa": Variable(SIMULATED, "kPa", "its slope, per (unitless) cycle"),
        }
    },
}
