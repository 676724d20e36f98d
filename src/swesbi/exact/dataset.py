"""The exact posterior as groups of ``posterior.h5``, and back.

The file is a posterior like any other, for :func:`swesbi.inference.dataset.read_posterior` and whatever
reads it, with the passive scale, the weights and how the draws were come by beside it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swesbi.artefacts import build_dataset, load
from swesbi.artefacts.kinds.exact import SCHEMAS
from swesbi.exact.importance import WeightedDraws
from swesbi.exact.posterior import ExactPosterior, Sampler
from swesbi.exact.settings import ExactSettings
from swesbi.inference.dataset import POSTERIOR, posterior_to_groups
from swesbi.inference.posterior import Posterior, summarise_posterior
from swesbi.inference.settings import PosteriorSettings
from swesbi.intervals import interval_levels
from swesbi.parameters import OF_THETA, PHI_NAMES, SCALE
from swesbi.prior import JointPriorSettings

FloatArray = NDArray[np.float64]
SCHEMA = SCHEMAS["exact_posterior"]
SCALARS = ("sampler", "k_hat_limit", "r_hat", "effective_draws", "mcmc_steps", "k_hat", "efficiency")
SEPARATOR = "; "


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
    scale = build_dataset(SCHEMA["posterior"], {"passive_scale_kpa": exact.phi[None, :, -1]})
    groups["posterior"] = groups["posterior"].assign(scale.variables)
    groups["npe"] = build_dataset(SCHEMA["npe"], _columns(exact.npe_phi))
    weighted = exact.weighted
    values = {
        **_columns(weighted.phi),
        "from_prior": weighted.from_prior.astype(np.int8),
        "log_likelihood": weighted.log_likelihood,
        "log_weight": weighted.log_weight,
    }
    groups["weighted"] = build_dataset(SCHEMA["weighted"], values)
    return groups


def read_exact_posterior(path: Path) -> ExactPosterior:
    """Read what ``posterior.h5`` of an experiment on speeds holds beside the posterior of theta.

    Raises:
        ArtefactError: The file is not a posterior.
        KeyError: It is the posterior of an experiment without an exact likelihood.
    """
    names = ("/", "posterior", "npe", "weighted")
    root, draws, npe, weighted = (load(path, POSTERIOR, group)[0] for group in names)
    reasons = str(root["reasons"].item())
    return ExactPosterior(
        phi=np.stack([draws[name].to_numpy()[0] for name in PHI_NAMES], axis=1),
        sampler=cast("Sampler", str(root["sampler"].item())),
        reasons=tuple(reasons.split(SEPARATOR)) if reasons else (),
        k_hat_limit=float(root["k_hat_limit"]),
        npe_phi=_phi(npe),
        weighted=WeightedDraws(
            phi=_phi(weighted),
            from_prior=weighted["from_prior"].to_numpy().astype(bool),
            log_likelihood=weighted["log_likelihood"].to_numpy(),
            log_weight=weighted["log_weight"].to_numpy(),
            k_hat=float(root["k_hat"]),
            efficiency=float(root["efficiency"]),
            log_evidence=float(root["log_evidence"]),
            log_evidence_se=float(root["log_evidence_se"]),
        ),
        r_hat=root["r_hat"].to_numpy(),
        effective_draws=root["effective_draws"].to_numpy(),
        mcmc_steps=int(root["mcmc_steps"]),
        converged=bool(root["converged"]),
    )


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
    values = {
        **{name: getattr(exact, name) for name in SCALARS},
        "converged": np.int8(exact.converged),
        "reasons": SEPARATOR.join(exact.reasons),
        "log_evidence": exact.weighted.log_evidence,
        "log_evidence_se": exact.weighted.log_evidence_se,
        "passive_scale_median_kpa": np.median(scale),
        "passive_scale_interval_kpa": np.quantile(scale, interval_levels(interval)),
    }
    return build_dataset(SCHEMA["/"], values).assign_coords(joint_parameter=list(PHI_NAMES))


def _columns(phi: FloatArray) -> dict[str, FloatArray]:
    return {name: phi[:, j] for j, name in enumerate(PHI_NAMES)}


def _phi(group: xr.Dataset) -> FloatArray:
    return np.stack([group[name].to_numpy() for name in PHI_NAMES], axis=1)
