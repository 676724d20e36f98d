"""The schema of the posteriors under one variant of the configuration."""

from typing import Final

from swesbi.artefacts.variable import Variable

SCHEMAS: Final = {
    "sensitivity": {
        "/": {
            "phi": Variable(("subject", "draw", "parameter"), "kPa, s-1, s-1, kPa", "exact posterior draws"),
            "by_mcmc": Variable(("subject",), "1", "1 by MCMC, 0 by importance weights"),
            "k_hat": Variable(("subject",), "1", "Pareto shape of the importance weights"),
            "efficiency": Variable(("subject",), "1", "effective share of the weighted draws"),
            "converged": Variable(("subject",), "1", "1 where the draws are reliable"),
        }
    },
}
