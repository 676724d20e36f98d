"""The schema of the passive baseline of one subject."""

from swesbi.artefacts.variable import Variable

SCHEMAS = {
    "passive": {
        "/": {
            "scale_kpa": Variable((), "kPa", "scale a_d: passive stiffness at stretch 1"),
            "cycle_phase": Variable(("cycle",), "1", "fraction of the cycle from the R peak"),
            "stretch": Variable(("cycle",), "1", "wall stretch of the reference beat"),
            "stiffness_kpa": Variable(("cycle",), "kPa", "passive stiffness E_pass"),
            "late_diastolic_observed_kpa": Variable((), "kPa", "observed late-diastolic mean, which is met"),
            "late_diastolic_active_kpa": Variable((), "kPa", "active part of it in the reference beat"),
        }
    }
}
