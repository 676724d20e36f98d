"""The schema of the study of identifiability: what recordings tell, and what others would."""

from typing import Final

from swesbi.artefacts.variable import Variable

PHI: Final = "kPa, s-1, s-1, kPa"
QUANTITIES: Final = "kPa, s-1, s-1, kPa, kPa"
BY_QUANTITY: Final = ("subject", "quantity")
BY_PHASE: Final = ("subject", "quantity", "phase")
BY_DESIGN: Final = ("subject", "quantity", "phases", "repeats")

SCHEMAS: Final = {
    "identifiability": {
        "/": {
            "median": Variable(BY_QUANTITY, QUANTITIES, "posterior median"),
            "sd_log": Variable(BY_QUANTITY, "1", "posterior sd of the log"),
            "expected_sd_log": Variable(BY_QUANTITY, "1", "sd of the log expected from the information"),
            "expected_sd_log_at_median": Variable(BY_QUANTITY, "1", "the same at the posterior median alone"),
            "contraction": Variable(BY_QUANTITY, "1", "1 - posterior variance / prior variance"),
            "contraction_log": Variable(BY_QUANTITY, "1", "the same of the log"),
            "interval_mass": Variable((), "1", "mass of credible, level of likelihood-ratio intervals"),
            "shown_phi": Variable(("subject", "draw", "parameter"), PHI, "posterior draws for the figure"),
        },
        "profile": {
            "maximum_phi": Variable(("subject", "parameter"), PHI, "greatest likelihood in the prior's box"),
            "log_likelihood": Variable(("subject",), "1", "log likelihood there"),
            "activation_duration_s": Variable(("subject",), "s", "duration D_T of the activation"),
            "value": Variable(("subject", "parameter", "point"), PHI, "grid of each parameter"),
            "deviance": Variable(
                ("subject", "parameter", "point"), "1", "2 (log L_max - log L), maximised over the others"
            ),
            "interval": Variable(("subject", "parameter", "bound"), PHI, "likelihood-ratio interval"),
            "closed": Variable(
                ("subject", "parameter", "bound"), "1", "0 where it is open, up to the bound of the prior"
            ),
            "k0_kpa": Variable(("subject", "k0_point"), "kPa", "grid of k_0"),
            "k_atp_per_s": Variable(("subject", "k_atp_point"), "s-1", "grid of k_ATP"),
            "pair_deviance": Variable(("subject", "k0_point", "k_atp_point"), "1", "over both"),
            "confidence_level": Variable(("level",), "1", "levels that are marked"),
        },
        "phases": {
            "phase_of": Variable(("subject", "phase"), "1", "phase, fraction of the cycle from the R peak"),
            "measured": Variable(("subject", "phase"), "1", "1 where measured; the rest is NaN elsewhere"),
            "share": Variable(BY_PHASE, "1", "share in the expected information, all else known"),
            "expected_sd_increase": Variable(BY_PHASE, "1", "expected relative growth of the sd without it"),
            "left_out_sd_increase": Variable(BY_PHASE, "1", "the same of the draws, reweighted"),
            "left_out_mean_shift": Variable(BY_PHASE, "1", "change of the mean log without it, in sd"),
            "k_hat": Variable(("subject", "phase"), "1", "Pareto k of the weights; reliable below 0.7"),
        },
        "design": {
            "sd_log": Variable(
                BY_DESIGN, "1", "expected sd of the log; model errors of near phases correlated"
            ),
            "sd_log_independent": Variable(BY_DESIGN, "1", "the same with independent model errors"),
            "floor": Variable(("subject", "quantity", "phases"), "1", "sd of the log without any noise"),
            "floor_independent": Variable(
                ("subject", "quantity", "phases"), "1", "the same with independent model errors"
            ),
            "repeat_se": Variable(("subject",), "1", "relative standard error of one repeat's mean speed"),
            "own_repeats": Variable(("subject",), "1", "repeats of the recording, equivalent"),
            "own_phases": Variable(("subject",), "1", "measured phases of the recording"),
        },
        "placement": {
            "phase": Variable(("choice",), "1", "phases chosen, best first"),
            "sd_log": Variable(
                ("subject", "quantity", "placed"), "1", "expected sd of the log with the first so many"
            ),
            "sd_log_even": Variable(("subject", "quantity", "placed"), "1", "with as many, evenly spaced"),
        },
    }
}
