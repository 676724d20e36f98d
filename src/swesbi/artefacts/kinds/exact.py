"""What the posterior of an experiment on speeds holds beside the groups of every posterior."""

from swesbi.artefacts.variable import Variable

# Such a file is of the kind "posterior", and has that kind's groups too.
SCHEMAS = {
    "exact_posterior": {
        "/": {
            "sampler": Variable((), "1", "what gave the draws: importance or mcmc"),
            "converged": Variable((), "1", "1 where weights or sampler are reliable, else 0"),
            "reasons": Variable((), "1", "why the weights were not used, what the sampler missed; or empty"),
            "k_hat": Variable((), "1", "Pareto shape of the importance weights"),
            "k_hat_limit": Variable((), "1", "largest Pareto shape of reliable weights"),
            "efficiency": Variable((), "1", "effective share of the weighted draws"),
            "log_evidence": Variable((), "1", "log evidence of the log speeds, from the weights"),
            "log_evidence_se": Variable((), "1", "its Monte Carlo standard error"),
            "r_hat": Variable(("joint_parameter",), "1", "rank-normalised split R-hat; NaN without MCMC"),
            "effective_draws": Variable(("joint_parameter",), "1", "effective number behind the draws"),
            "mcmc_steps": Variable((), "1", "steps of each walker, warm-up included; 0 without MCMC"),
            "passive_scale_median_kpa": Variable((), "kPa", "posterior median of the passive scale a"),
            "passive_scale_interval_kpa": Variable(("bound",), "kPa", "credible interval of the scale a"),
        },
        "posterior": {
            "passive_scale_kpa": Variable(("chain", "draw"), "kPa", "passive scale a"),
        },
        "npe": {
            "k0_kpa": Variable(("draw",), "kPa", "active stiffness scale k_0, of the network"),
            "k_atp_per_s": Variable(("draw",), "s-1", "contraction rate k_ATP, of the network"),
            "k_sr_per_s": Variable(("draw",), "s-1", "relaxation rate k_SR, of the network"),
            "passive_scale_kpa": Variable(("draw",), "kPa", "passive scale a, of the network"),
        },
        "weighted": {
            "k0_kpa": Variable(("draw",), "kPa", "active stiffness scale k_0"),
            "k_atp_per_s": Variable(("draw",), "s-1", "contraction rate k_ATP"),
            "k_sr_per_s": Variable(("draw",), "s-1", "relaxation rate k_SR"),
            "passive_scale_kpa": Variable(("draw",), "kPa", "passive scale a"),
            "from_prior": Variable(("draw",), "1", "1 where drawn from the prior, 0 from the network"),
            "log_likelihood": Variable(("draw",), "1", "exact log likelihood of the log speeds"),
            "log_weight": Variable(("draw",), "1", "log of the smoothed weights, which sum to one"),
        },
    }
}
