"""What is shown of an exact posterior: its draws, the network's, and how reliable they are.

Read from ``posterior.h5`` without the libraries that made it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swesbi.artefacts import load
from swesbi.parameters import PHI_NAMES
from swesbi.posterior.truncated import POSTERIOR

FloatArray = NDArray[np.float64]
MCMC: Final = "mcmc"
NUISANCE_PARAMETERS: Final = "nuisance_parameters"
"""The dataset of the nuisance parameters in each group of draws."""
NPE: Final = "npe"
"""The group of the network's own draws."""
PRIOR_DRAWS: Final = "prior_draws"
"""The group of the prior's draws, in place of the network's where there was none."""


@dataclass(frozen=True)
class ExactResult:
    """The exact posterior of one recording.

    Attributes:
        phi: Equally weighted draws; shape (n, d).
        npe_phi: Draws of the network as they came, or of the prior where there was none; shape (m, d).
        sampler: What gave ``phi``: importance or mcmc.
        k_hat: Pareto shape of the importance weights.
        k_hat_limit: Largest shape of reliable weights.
        efficiency: Effective share of the weighted draws.
        r_hat: Largest split R-hat of the sampler over the parameters; NaN without one.
        converged: Weights, or the sampler, are reliable.
        reasons: Why the weights were not used, and what the sampler missed, in sentences; or empty.
        interval_mass: Mass of the credible intervals.
    """

    phi: FloatArray
    npe_phi: FloatArray
    sampler: str
    k_hat: float
    k_hat_limit: float
    efficiency: float
    r_hat: float
    converged: bool
    reasons: str
    interval_mass: float

    @property
    def by_mcmc(self) -> bool:
        """Whether the sampler, and not the weights, gave the draws."""
        return self.sampler == MCMC


def read_exact_result(path: Path) -> ExactResult:
    """Read what figures, tables and predictive checks take from ``posterior.h5`` of an experiment on speeds.

    Raises:
        ArtefactError: The file is not a posterior.
        KeyError: It is the posterior of an experiment on features.
    """
    root, draws = (load(path, POSTERIOR, group)[0] for group in ("/", "posterior"))
    first, _ = load(path, POSTERIOR, group_of_first(root.sizes["component"]))
    return ExactResult(
        phi=phi_of(draws.isel(chain=0)),
        npe_phi=phi_of(first),
        sampler=str(root["sampler"].item()),
        k_hat=float(root["k_hat"]),
        k_hat_limit=float(root["k_hat_limit"]),
        efficiency=float(root["efficiency"]),
        r_hat=float(root["r_hat"].max()),
        converged=bool(root["converged"]),
        reasons=str(root["reasons"].item()),
        interval_mass=float(root["interval_mass"]),
    )


def group_of_first(components: int) -> str:
    """Return which group holds the draws with which the inference began.

    Args:
        components: Of the network's conditioning vector; none where there was no network.
    """
    return NPE if components else PRIOR_DRAWS


def phi_of(group: xr.Dataset) -> FloatArray:
    """Return the draws of a group: what is reported by name, nuisance parameters behind it; shape (n, d)."""
    reported = np.stack([group[name].to_numpy() for name in PHI_NAMES], axis=-1)
    return np.hstack([reported, group[NUISANCE_PARAMETERS].to_numpy()])
