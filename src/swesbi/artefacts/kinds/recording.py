"""The schema of the observed curve of one subject."""

from swesbi.artefacts.variable import Variable

CONTEXT = {
    "sex": ("1", "F or M"),
    "age_years": ("year", "age"),
    "bsa_m2": ("m2", "body surface area"),
    "hr_bpm": ("min-1", "heart rate"),
    "lvedv_ml": ("mL", "left ventricular end-diastolic volume"),
    "lvesv_ml": ("mL", "left ventricular end-systolic volume"),
    "ivsd_cm": ("cm", "interventricular septal thickness at end diastole"),
}
"""Units and meaning of each value of a context."""


def _context(*dims: str) -> dict[str, Variable]:
    return {name: Variable(dims, *about, text=name == "sex") for name, about in CONTEXT.items()}


SCHEMAS = {
    "observation": {
        "/": {
            "phase": Variable(
                ("phase",), "1", "phase of the recording, fraction of the cycle from the R peak"
            ),
            "phase_index": Variable(("phase",), "1", "index of the phase in the recording"),
            "measured": Variable(("phase",), "1", "1 where the phase was measured, 0 where it is missing"),
            "speed_m_s": Variable(("phase",), "m s-1", "mean shear-wave speed c_s, NaN where missing"),
            "speed_se_m_s": Variable(("phase",), "m s-1", "standard error of c_s"),
            "stiffness_kpa": Variable(("phase",), "kPa", "apparent Young's modulus 3 rho c_s^2"),
            "stiffness_se_kpa": Variable(("phase",), "kPa", "standard error of the stiffness"),
            "grid": Variable(("grid",), "1", "uniform analysis grid, fraction of the cycle"),
            "curve_kpa": Variable(("grid",), "kPa", "observed stiffness E_obs on the analysis grid"),
            "samples_accepted": Variable(("phase",), "1", "accepted samples"),
            "samples_by_repeat": Variable(("phase", "repeat"), "1", "accepted samples of each repeat"),
            "reason": Variable(("reason",), "1", "reasons of rejection"),
            "samples_rejected": Variable(("reason", "phase"), "1", "rejected samples by reason"),
            "repeat_noise_fraction": Variable((), "1", "relative standard deviation between repeats"),
            "sample_noise_fraction": Variable((), "1", "relative standard deviation between samples"),
        },
        "context": _context(),
    },
    "contexts": {
        "/": {"subject": Variable(("subject",), "1", "subjects of the cohort"), **_context("subject")}
    },
}
