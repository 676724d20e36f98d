"""The schemas of experiments over a population: simulations, calibration, nulls of the tests."""

from typing import Final

from swesbi.artefacts.kinds.calibration import DIAGNOSTICS, RANKED
from swesbi.artefacts.variable import Variable

SIMULATED: Final = ("context", "draw", "phase")
OF_CONTEXT: Final = ("context", "phase")


def contexts_along(dimension: str) -> dict[str, Variable]:
    """Return the datasets of the contexts that lie along a dimension."""
    return {
        "sex": Variable((dimension,), "1", "F or M", text=True),
        "age_years": Variable((dimension,), "year", "age"),
        "bsa_m2": Variable((dimension,), "m2", "body surface area"),
        "hr_bpm": Variable((dimension,), "min-1", "heart rate"),
        "lvedv_ml": Variable((dimension,), "mL", "left ventricular end-diastolic volume"),
        "lvesv_ml": Variable((dimension,), "mL", "left ventricular end-systolic volume"),
        "ivsd_cm": Variable((dimension,), "cm", "interventricular septal thickness at end diastole"),
    }


_RECORDINGS: Final = (
    RANKED
    | DIAGNOSTICS
    | contexts_along("recording")
    | {
        "relative_se": Variable(
            ("recording",), "1", "standard error of the mean speed of a phase without failed samples, over it"
        )
    }
)

SCHEMAS: Final = {
    "population_simulations": {
        "/": contexts_along("context")
        | {
            "theta": Variable(("context", "draw", "parameter"), "kPa, s-1, s-1", "prior draws"),
            "active_stiffness_kpa": Variable(SIMULATED, "kPa", "active stiffness at the nominal phases"),
            "active_slope_kpa": Variable(SIMULATED, "kPa", "its slope, per (unitless) cycle"),
            "passive_shape": Variable(OF_CONTEXT, "1", "g along the reference beat of the context"),
            "passive_slope": Variable(OF_CONTEXT, "1", "its slope, per (unitless) cycle"),
            "failures": Variable(("context", "status"), "1", "failed simulations by status, drawn again"),
        }
    },
    "population_calibration": {"own": _RECORDINGS, "acquired": _RECORDINGS},
    "population_null": {
        "/": contexts_along("recording")
        | {
            "distance_level": Variable(
                ("recording", "distance"), "1", "share of the subject's own prior predictive that lies nearer"
            ),
            "features": Variable(("recording", "feature"), "log of kPa, or 1", "features S(.)"),
            "tails": Variable(("recording", "feature"), "1", "predictive probability of a smaller value"),
            "chi2_p": Variable(("recording",), "1", "posterior predictive p-value of chi2"),
            "bound_mass": Variable(("recording", "parameter", "bound"), "1", "posterior mass in the strip"),
            "k_hat": Variable(("recording",), "1", "Pareto shape of the importance weights"),
            "efficiency": Variable(("recording",), "1", "effective share of the weighted draws"),
            "prior_strip_mass": Variable(("parameter", "bound"), "1", "prior mass in the strip there"),
        }
    },
}
LABELS: Final = {
    "population_simulations": {"/": ("parameter", "subject")},
    "population_null": {"/": ("feature", "subject")},
}
