"""The profiles of one recording's likelihood: of each parameter, and of k_0 with k_ATP."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import Variable
from swesbi.identifiability.profile import Profile, interval, pair_profile, profile
from swesbi.identifiability.settings import IdentifiabilitySettings
from swesbi.identifiability.speeds import in_logit, maximum_likelihood
from swesbi.parameters import K_0, K_ATP, PHI_COLUMNS, PHI_NAMES
from swesbi.prior import JointPriorSettings, bounds, from_logit
from swesbi.speed_model.model import SpeedModel

FloatArray = NDArray[np.float64]
PAIR = (K_0, K_ATP)


@dataclass(frozen=True)
class Profiles:
    """The profiled likelihood; intervals end at the bound of the prior's box where they are open."""

    maximum_phi: Annotated[
        FloatArray, Variable("parameter", PHI_COLUMNS, "greatest likelihood in the prior's box")
    ]
    log_likelihood: Annotated[float, Variable("", "1", "log likelihood there")]
    value: Annotated[FloatArray, Variable("parameter point", PHI_COLUMNS, "grid of each parameter")]
    deviance: Annotated[
        FloatArray,
        Variable("parameter point", "1", "2 (log L_max - log L), maximised over the others"),
    ]
    interval: Annotated[FloatArray, Variable("parameter bound", PHI_COLUMNS, "likelihood-ratio interval")]
    closed: Annotated[
        NDArray[np.bool_],
        Variable("parameter bound", "1", "0 where it is open, up to the bound of the prior"),
    ]
    k0_kpa: Annotated[FloatArray, Variable("k0_point", "kPa", "grid of k_0")]
    k_atp_per_s: Annotated[FloatArray, Variable("k_atp_point", "s-1", "grid of k_ATP")]
    pair_deviance: Annotated[FloatArray, Variable("k0_point k_atp_point", "1", "over both")]


def profiles_of(model: SpeedModel, settings: IdentifiabilitySettings, seed: int) -> Profiles:
    """Find the greatest likelihood inside the prior's box, and profile it."""
    grid, prior = settings.profile, model.settings.prior
    problem = in_logit(model, settings.difference_step)
    found = maximum_likelihood(model, problem, grid.prior_starts, grid.searches, seed)
    best = found.x[found.best]
    sizes = (grid.coarse_points, grid.points)
    single = [profile(problem, j, best, *sizes) for j in range(len(PHI_NAMES))]
    pair = pair_profile(problem, single[PAIR[0]], single[PAIR[1]])
    # a profile may climb a little above the search, whose steps stop at a tolerance
    highest = max(found.log_likelihood.max(), *(one.log_likelihood.max() for one in (*single, pair)))
    ends, closed = _intervals(single, best, highest, settings.interval, prior)
    return Profiles(
        maximum_phi=from_logit(best, prior),
        log_likelihood=float(highest),
        value=np.stack([_phi_of(one.axes[0], j, prior) for j, one in enumerate(single)]),
        deviance=np.stack([one.deviance(highest) for one in single]),
        interval=ends,
        closed=closed,
        k0_kpa=_phi_of(pair.axes[0], PAIR[0], prior),
        k_atp_per_s=_phi_of(pair.axes[1], PAIR[1], prior),
        pair_deviance=pair.deviance(highest),
    )


def _intervals(
    single: list[Profile],
    best: FloatArray,
    maximum: float,
    level: float,
    prior: JointPriorSettings,
) -> tuple[FloatArray, NDArray[np.bool_]]:
    crossings = np.array([interval(one, best, maximum, level) for one in single])
    ends = np.stack([_phi_of(row, j, prior) for j, row in enumerate(crossings)])
    closed = np.isfinite(crossings)
    return np.where(closed, ends, np.column_stack(bounds(prior))), closed


def _phi_of(eta: FloatArray, parameter: int, prior: JointPriorSettings) -> FloatArray:
    """Return the values of one parameter for its logits."""
    return from_logit(np.repeat(eta[:, None], len(PHI_NAMES), axis=1), prior)[:, parameter]
