"""The schema of the prior-simulation shards."""

from swesbi.artefacts.variable import Variable

SCHEMAS = {
    "simulations": {
        "/": {
            "draw_index": Variable(("simulation",), "1", "number of the draw within the subject"),
            "theta": Variable(("simulation", "parameter"), "kPa, s-1, s-1", "active parameters"),
            "attempts": Variable(("simulation",), "1", "theta drawn until a simulation succeeded"),
            "failures": Variable(("simulation", "status"), "1", "failed attempts by status"),
            "cycle_phase": Variable(("cycle",), "1", "fraction of the cycle from the R peak"),
            "active_stiffness_kpa": Variable(("simulation", "cycle"), "kPa", "active stiffness k_c"),
            "end_diastolic_volume_ml": Variable(("simulation",), "mL", "largest cavity volume"),
            "end_systolic_volume_ml": Variable(("simulation",), "mL", "smallest cavity volume"),
            "beats": Variable(("simulation",), "1", "beats until periodic"),
        }
    }
}

LABELS = {"simulations": {"/": ("parameter",)}}
