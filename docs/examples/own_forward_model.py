"""One's own forward model in place of this project's: the same recording, noise and sampler.

    python docs/examples/own_forward_model.py

A model needs a prior of each parameter, and a function from parameters to log speeds and their slopes at the
recording's phases. Here stiffness is a level and one contraction, with no physiology behind them.
"""

import numpy as np

import swesbi

recording = swesbi.read_recording("data/virtual_volunteers/swe/G.csv", from_prior=True)
phase = recording.speeds.phase
DENSITY_KG_M3 = 1000.0

prior = {
    "resting_kpa": swesbi.ParameterPrior(centre=5.0, log_sd=0.7, low=0.5, high=50.0),
    "contracted_kpa": swesbi.ParameterPrior(centre=60.0, log_sd=0.7, low=5.0, high=500.0),
    "middle_cycle": swesbi.ParameterPrior(centre=0.25, log_sd=0.3, low=0.05, high=0.8),
    "width_cycle": swesbi.ParameterPrior(centre=0.1, log_sd=0.4, low=0.02, high=0.4),
}


def log_speed(phi: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return log speeds in m/s of parameters (n, 4) at phases (p,): E = 3 rho c^2."""
    resting, contracted, middle, width = (column[:, None] for column in phi.T)
    stiffness_kpa = resting + contracted * np.exp(-0.5 * ((at - middle) / width) ** 2)
    return 0.5 * np.log(1000.0 * stiffness_kpa / (3.0 * DENSITY_KG_M3))


def log_likelihood(phi: np.ndarray) -> np.ndarray:
    """Return log p(speeds | phi), with the noise of the recording's folder; shape (n,)."""
    step = 1e-4
    slope = (log_speed(phi, phase + step) - log_speed(phi, phase - step)) / (2.0 * step)
    return recording.log_density(log_speed(phi, phase), slope)


found = swesbi.sample_posterior(log_likelihood, prior, seed=1)
for name in prior:
    low, median, high = np.quantile(found.posterior[name], [0.05, 0.5, 0.95])
    print(f"{name:15} {median:.3g} (90 % interval {low:.3g} to {high:.3g})")
print("converged" if found.attrs["converged"] else "NOT CONVERGED")
