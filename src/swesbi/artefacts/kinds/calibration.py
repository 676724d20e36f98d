"""The schemas of calibration: recordings of known parameters, and what each sampler made of them."""

from typing import Final

from swesbi.artefacts.variable import Variable

EACH: Final = "as named in quantity"
SQUARED: Final = "as named in quantity, squared"


def _ranked() -> dict[str, Variable]:
    content = {
        "truth": Variable(("recording", "quantity"), EACH, "true value"),
        "prior_variance": Variable(("recording", "quantity"), SQUARED, "before the recording is seen"),
    }
    for sampler, words in (("npe", "the network"), ("weighted", "the exact posterior")):
        content |= {
            f"{sampler}_level": Variable(
                ("recording", "quantity"), "1", f"mid-rank of the truth among the draws of {words}"
            ),
            f"{sampler}_tarp": Variable(
                ("recording",), "1", f"mass of {words} nearer to a random point than the truth"
            ),
            f"{sampler}_mean": Variable(("recording", "quantity"), EACH, f"mean of {words}"),
            f"{sampler}_sd": Variable(("recording", "quantity"), EACH, f"standard deviation of {words}"),
        }
    return content


RANKED: Final = _ranked()
DIAGNOSTICS: Final = {
    "k_hat": Variable(("recording",), "1", "Pareto shape of the importance weights"),
    "efficiency": Variable(("recording",), "1", "effective share of the weighted draws"),
    "log_evidence": Variable(("recording",), "1", "log evidence of the log speeds, from the weights"),
    "by_mcmc": Variable(("recording",), "1", "1 where MCMC took over from the weights"),
    "phases": Variable(("recording",), "1", "measured phases"),
    "min_chi2": Variable(("recording",), "1", "smallest sum of squared residuals over posterior draws"),
    "mean_chi2": Variable(("recording",), "1", "mean sum of squared residuals over posterior draws"),
    "strip_mass": Variable(
        ("recording", "parameter", "bound"), "1", "posterior mass in the strip at each bound of the prior"
    ),
}
RECORDINGS: Final = {"own": RANKED | DIAGNOSTICS, "acquired": RANKED | DIAGNOSTICS}
LOCAL: Final = {
    "local": RANKED,
    "two_samples": {
        "accuracy": Variable(("subject", "pair"), "1", "accuracy of a classifier between two samplers"),
        "draws": Variable(("subject",), "1", "draws of each sampler"),
    },
}

SCHEMAS: Final = {
    "calibration_recordings": RECORDINGS,
    "calibration_local": LOCAL,
    "calibration": RECORDINGS | LOCAL,
}
