"""The schema of one subject's null distributions and of the recordings that measure the tests' power."""

from typing import Final

from swesbi.artefacts.variable import Variable

FEATURES = "log of kPa, or 1"
_RECORDINGS = {
    "features": Variable(("recording", "feature"), FEATURES, "features S(.) as the network sees them"),
    "tails": Variable(("recording", "feature"), "1", "predictive probability of a smaller value"),
    "chi2_p": Variable(("recording",), "1", "posterior predictive p-value of chi2"),
    "bound_mass": Variable(("recording", "parameter", "bound"), "1", "posterior mass in the strip there"),
    "k_hat": Variable(("recording",), "1", "Pareto shape of the importance weights"),
    "efficiency": Variable(("recording",), "1", "effective share of the weighted draws"),
}

SCHEMAS: Final = {
    "misspecification": {
        "/": {
            "reference_features": Variable(("reference", "feature"), FEATURES, "prior predictive features"),
            "prior_strip_mass": Variable(("parameter", "bound"), "1", "prior mass in the strip there"),
            "refused": Variable(("kind_of_recording",), "1", "recordings that ingestion refused"),
        },
        "null": _RECORDINGS,
        "own": _RECORDINGS,
        "acquired": _RECORDINGS,
        "volunteer": _RECORDINGS,
    }
}
