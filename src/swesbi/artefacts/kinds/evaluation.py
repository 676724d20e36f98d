"""The schemas of the predictive checks and of the CMA-ES fits."""

from swesbi.artefacts.variable import Variable

THETA_UNITS = "kPa, s-1, s-1"
FEATURE_UNITS = "as named in feature"

PREDICTION = {
    "theta": Variable(("draw", "parameter"), THETA_UNITS, "active parameters"),
    "curve_kpa": Variable(("draw", "grid"), "kPa", "total stiffness on the grid, as measured"),
    "phase_kpa": Variable(("draw", "phase"), "kPa", "total stiffness at the phases of the recording"),
    "features": Variable(("draw", "feature"), FEATURE_UNITS, "checked features, without noise"),
    "end_diastolic_volume_ml": Variable(("draw",), "mL", "largest cavity volume of the simulated beat"),
    "end_systolic_volume_ml": Variable(("draw",), "mL", "smallest cavity volume of the simulated beat"),
    "ejection_fraction": Variable(("draw",), "1", "ejection fraction of the simulated beat"),
    "attained_stiffness_kpa": Variable(("draw",), "kPa", "k_0 (1 - exp(-k_ATP D_T)), D_T the activation"),
    "curve_median_kpa": Variable(("grid",), "kPa", "predictive median"),
    "curve_low_kpa": Variable(("grid",), "kPa", "lower end of the predictive interval"),
    "curve_high_kpa": Variable(("grid",), "kPa", "upper end of the predictive interval"),
    "phase_median_kpa": Variable(("phase",), "kPa", "predictive median"),
    "phase_low_kpa": Variable(("phase",), "kPa", "lower end of the predictive interval"),
    "phase_high_kpa": Variable(("phase",), "kPa", "upper end of the predictive interval"),
    "feature_median": Variable(("feature",), FEATURE_UNITS, "predictive median, noise included"),
    "feature_low": Variable(("feature",), FEATURE_UNITS, "lower end of the predictive interval"),
    "feature_high": Variable(("feature",), FEATURE_UNITS, "upper end of the predictive interval"),
    "rmse_kpa": Variable((), "kPa", "RMSE of the median on the grid"),
    "nrmse": Variable((), "1", "RMSE over the observed range, on the grid"),
    "r2": Variable((), "1", "coefficient of determination on the grid"),
    "post_peak_rmse_kpa": Variable((), "kPa", "RMSE from the observed peak on, on the grid"),
    "coverage": Variable((), "1", "fraction of the grid inside the interval"),
    "phases_rmse_kpa": Variable((), "kPa", "RMSE of the median at the measured phases"),
    "phases_nrmse": Variable((), "1", "RMSE over the observed range, at the measured phases"),
    "phases_r2": Variable((), "1", "coefficient of determination at the measured phases"),
    "phases_post_peak_rmse_kpa": Variable((), "kPa", "RMSE from the observed peak on, measured phases"),
    "phases_coverage": Variable((), "1", "fraction of the measured phases inside the interval"),
    "coverage_recording_noise": Variable(
        (), "1", "fraction of the measured phases inside the interval of a new recording, noise included"
    ),
    "failed": Variable((), "1", "draws left out because their simulation failed"),
}

SCHEMAS = {
    "predictive": {
        "/": {
            "grid": Variable(("grid",), "1", "analysis phases, fraction of the cycle from the R peak"),
            "curve_kpa": Variable(("grid",), "kPa", "observed curve"),
            "phase": Variable(("phase",), "1", "phases of the recording, fraction of the cycle"),
            "measured": Variable(("phase",), "1", "1 measured, 0 missing"),
            "stiffness_kpa": Variable(("phase",), "kPa", "observed stiffness"),
            "stiffness_se_kpa": Variable(("phase",), "kPa", "standard error of the observed stiffness"),
            "features": Variable(("feature",), FEATURE_UNITS, "checked features of the observed curve"),
            "feature_noise_sd": Variable(("feature",), FEATURE_UNITS, "sd of the observation noise"),
            "lvedv_ml": Variable((), "mL", "measured end-diastolic volume"),
            "lvesv_ml": Variable((), "mL", "measured end-systolic volume"),
            "interval": Variable((), "1", "probability mass of every interval"),
            "supported": Variable((), "1", "1 where the subject has prior support"),
        },
        "prior": PREDICTION,
        "posterior": PREDICTION,
    },
    "cmaes": {
        "/": {
            "seed": Variable(("run",), "1", "seed of each run"),
            "best_loss": Variable(("run", "generation"), "1", "lowest loss up to each generation"),
            "best_theta": Variable(("run", "generation", "parameter"), THETA_UNITS, "its parameters"),
            "evaluations": Variable(("run", "generation"), "1", "simulations up to each generation"),
            "generations": Variable(("run",), "1", "generations run"),
            "run_loss": Variable(("run",), "1", "lowest loss of each run"),
            "run_theta": Variable(("run", "parameter"), THETA_UNITS, "parameters of that loss"),
            "theta": Variable(("parameter",), THETA_UNITS, "parameters of the best run"),
            "loss": Variable((), "1", "loss of the best run"),
            "best_seed": Variable((), "1", "seed of the best run"),
            "grid": Variable(("grid",), "1", "analysis phases, fraction of the cycle from the R peak"),
            "curve_kpa": Variable(("grid",), "kPa", "total stiffness of the best theta, as measured"),
            "rmse_kpa": Variable((), "kPa", "RMSE of that curve against the observed one"),
        }
    },
}

LABELS = {"predictive": {"/": ("feature",)}, "cmaes": {"/": ("parameter", "stop")}}
