"""The exact posterior as groups of ``posterior.h5``, and back.

The file is a posterior like any other, for :func:`swesbi.inference.dataset.read_posterior` and whatever
reads it, with the passive scale, the weights and how the draws were come by beside it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swesbi.artefacts import Variable, arranged, build_dataset, from_groups, load, schema_of, values_of
from swesbi.exact.posterior import ExactPosterior
from swesbi.exact.settings import ExactSettings
from swesbi.inference.dataset import POSTERIOR, columns_along, columns_of, posterior_to_groups, rows_of
from swesbi.inference.posterior import Posterior, summarise_posterior
from swesbi.inference.settings import PosteriorSettings
from swesbi.intervals import interval_levels
from swesbi.parameters import OF_THETA, PHI_NAMES, SCALE
from swesbi.prior import JointPriorSettings

FloatArray = NDArray[np.float64]
OWN: Final = schema_of(ExactPosterior)
SCALE_NAME: Final = PHI_NAMES[-1:]
SCHEMA: Final = {
    "/": arranged(
        OWN["/"]
        | {
            "reasons": Variable(
                "", "1", "why the weights were not used, what the sampler missed; or empty", after="converged"
            ),
            "passive_scale_median_kpa": Variable("", "kPa", "posterior median of the passive scale a"),
            "passive_scale_interval_kpa": Variable("bound", "kPa", "credible interval of the scale a"),
        }
    ),
    "posterior": columns_along("chain draw", SCALE_NAME),
    "npe": columns_along("draw", PHI_NAMES, ", of the network"),
    "weighted": columns_along("draw", PHI_NAMES) | OWN["weighted"],
}
"""What ``posterior.h5`` of such an experiment has beside the groups and datasets of every posterior."""
SEPARATOR: Final = "; "


def exact_to_groups(
    exact: ExactPosterior,
    z_obs: FloatArray,
    component_names: tuple[str, ...],
    prior: JointPriorSettings,
    settings: ExactSettings,
) -> dict[str, xr.Dataset]:
    """Return the groups of ``posterior.h5``.

    Args:
        exact: The posterior of one recording.
        z_obs: Conditioning vector of the network; shape (C,).
        component_names: Names of its components.
        prior: The joint prior.
        settings: Gives the interval's mass.
    """
    groups = posterior_to_groups(_summary(exact, z_obs, component_names, prior, settings))
    groups["/"] = xr.merge([groups["/"], _root(exact, settings.interval)], combine_attrs="no_conflicts")
    scale = build_dataset(SCHEMA["posterior"], columns_of(exact.phi[None, :, -1:], SCALE_NAME))
    groups["posterior"] = groups["posterior"].assign(scale.variables)
    groups["npe"] = build_dataset(SCHEMA["npe"], columns_of(exact.npe_phi, PHI_NAMES))
    weighted = columns_of(exact.weighted.phi, PHI_NAMES) | values_of(exact)["weighted"]
    groups["weighted"] = build_dataset(SCHEMA["weighted"], weighted)
    return groups


def read_exact_posterior(path: Path) -> ExactPosterior:
    """Read what ``posterior.h5`` of an experiment on speeds holds beside the posterior of theta.

    Raises:
        ArtefactError: The file is not a posterior.
        KeyError: It is the posterior of an experiment without an exact likelihood.
    """
    groups = {group: load(path, POSTERIOR, group)[0] for group in SCHEMA}
    reasons = str(groups["/"]["reasons"].item())
    given = {
        "phi": rows_of(groups["posterior"].isel(chain=0), PHI_NAMES),
        "reasons": tuple(reasons.split(SEPARATOR)) if reasons else (),
        "npe_phi": rows_of(groups["npe"], PHI_NAMES),
        "weighted.phi": rows_of(groups["weighted"], PHI_NAMES),
    }
    return from_groups(ExactPosterior, groups, given)


def _summary(
    exact: ExactPosterior,
    z_obs: FloatArray,
    component_names: tuple[str, ...],
    prior: JointPriorSettings,
    settings: ExactSettings,
) -> Posterior:
    """Return the posterior of theta; its candidates are the network's draws, none of which can leak."""
    kept = PosteriorSettings(
        draws=settings.draws, unfiltered_draws=settings.draws, interval=settings.interval
    )
    summary = summarise_posterior(exact.phi[:, OF_THETA], z_obs, component_names, prior.theta, kept)
    npe = exact.npe_phi[:, OF_THETA]
    return replace(summary, unfiltered=npe, unfiltered_in_prior=np.ones(len(npe), dtype=bool))


def _root(exact: ExactPosterior, interval: float) -> xr.Dataset:
    scale = exact.phi[:, SCALE]
    values = values_of(exact)["/"] | {
        "reasons": SEPARATOR.join(exact.reasons),
        "passive_scale_median_kpa": np.median(scale),
        "passive_scale_interval_kpa": np.quantile(scale, interval_levels(interval)),
    }
    return build_dataset(SCHEMA["/"], values, {"joint_parameter": list(PHI_NAMES)})
