"""The schemas of the training pool and of the posterior."""

from typing import Final

from swesbi.artefacts.variable import Variable

THETA = "kPa, s-1, s-1"
MIXED = "as listed in component_unit"

SCHEMAS: Final = {
    "pool": {
        "/": {
            "theta": Variable(("sample", "parameter"), THETA, "parameters of each row"),
            "z": Variable(("sample", "component"), "1", "standardised conditioning vector of each row"),
            "subject_index": Variable(("sample",), "1", "position of the row's subject in `subject`"),
            "draw_index": Variable(("sample",), "1", "number of the row's prior draw within its subject"),
            "mean": Variable(("component",), MIXED, "pooled mean, of the raw component"),
            "scale": Variable(("component",), MIXED, "pooled standard deviation; 1 where constant"),
            "observed": Variable(("subject", "component"), MIXED, "observed features and context, raw"),
            "z_obs": Variable(("subject", "component"), "1", "standardised observed conditioning vector"),
        }
    },
    "posterior": {
        "/": {
            "median": Variable(("parameter",), THETA, "posterior median"),
            "interval": Variable(("parameter", "bound"), THETA, "equal-tailed credible interval"),
            "interval_mass": Variable((), "1", "mass of the credible interval"),
            "correlation": Variable(("parameter", "other_parameter"), "1", "posterior correlation"),
            "z_obs": Variable(("component",), "1", "standardised observed conditioning vector"),
        },
        "posterior": {
            "k0_kpa": Variable(("chain", "draw"), "kPa", "active stiffness scale k_0"),
            "k_atp_per_s": Variable(("chain", "draw"), "s-1", "contraction rate k_ATP"),
            "k_sr_per_s": Variable(("chain", "draw"), "s-1", "relaxation rate k_SR"),
        },
        "unfiltered": {
            "k0_kpa": Variable(("draw",), "kPa", "active stiffness scale k_0, not filtered"),
            "k_atp_per_s": Variable(("draw",), "s-1", "contraction rate k_ATP, not filtered"),
            "k_sr_per_s": Variable(("draw",), "s-1", "relaxation rate k_SR, not filtered"),
            "in_prior": Variable(("draw",), "1", "whether the draw lies within the prior's bounds"),
        },
    },
}

LABELS: Final = {
    "pool": {"/": ("parameter", "component", "component_unit", "subject")},
    "posterior": {"/": ("parameter", "component")},
}
