"""The exact posterior: importance weights, and MCMC where they are not reliable.

The file is a posterior like any other, for :func:`swesbi.posterior.truncated.read_posterior` and whatever
reads it, with the passive stiffness, the weights and how the draws were obtained beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Final, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from swesbi.artefacts import Part, Variable, arranged, build_dataset, from_groups, load, schema_of, values_of
from swesbi.draws import equal_weights
from swesbi.parameters import NUISANCE_COLUMNS, OF_THETA, PHI_NAMES, REPORTED
from swesbi.posterior import truncated
from swesbi.posterior.adaptive import PriorProposal, adapted, adaptive_rounds
from swesbi.posterior.importance import LikelihoodModel, WeightedDraws, k_hat_limit, resample
from swesbi.posterior.mcmc import McmcDraws, sample_mcmc, starting_points
from swesbi.posterior.result import NPE, NUISANCE_PARAMETERS, PRIOR_DRAWS, group_of_first, phi_of
from swesbi.posterior.settings import ExactSettings, McmcSettings, PosteriorSettings, asking
from swesbi.posterior.space import PlacedProposal
from swesbi.prior import JointPriorSettings
from swesbi.seeds import generator, integer_seed

FloatArray = NDArray[np.float64]
Sampler = Literal["importance", "mcmc"]
SCALE_NAME: Final = PHI_NAMES[-1:]
NUISANCE: Final = "nuisance"
SEPARATOR: Final = "; "


@dataclass(frozen=True)
class ExactPosterior:
    """Equally weighted draws of the exact posterior of one recording, and how they were obtained.

    Attributes:
        phi: Draws; shape (n, d).
        reasons: Why the weights were not used, and what the sampler then missed; empty if all is well.
        npe_phi: Draws of the proposal as they came, of the prior where there is no network; shape (m, d).
        weighted: All draws of the proposal with their weights.
        effective_draws: By parameter; shape (d,).
        converged: Weights that are reliable, or a sampler that reached its R-hat and effective draws.
    """

    phi: FloatArray
    sampler: Annotated[Sampler, Variable("", "1", "what gave the draws: importance or mcmc")]
    reasons: tuple[str, ...]
    k_hat_limit: Annotated[
        float, Variable("", "1", "largest Pareto shape of reliable weights", after="k_hat")
    ]
    npe_phi: FloatArray
    weighted: Annotated[WeightedDraws, Part()]
    r_hat: Annotated[
        FloatArray, Variable("joint_parameter", "1", "rank-normalised split R-hat; NaN without MCMC")
    ]
    effective_draws: Annotated[
        FloatArray, Variable("joint_parameter", "1", "effective number behind the draws")
    ]
    mcmc_steps: Annotated[int, Variable("", "1", "steps of each walker, warm-up included; 0 without MCMC")]
    converged: Annotated[
        bool, Variable("", "1", "1 where weights or sampler are reliable, else 0", after="sampler")
    ]

    @property
    def k_hat(self) -> float:
        """Pareto shape of the weights."""
        return self.weighted.k_hat

    @property
    def efficiency(self) -> float:
        """Effective share of the weighted draws."""
        return self.weighted.efficiency

    @property
    def log_evidence(self) -> float:
        """Logarithm of the evidence by the weights; as reliable as they are."""
        return self.weighted.log_evidence


def exact_posterior(
    model: LikelihoodModel,
    network: PlacedProposal | None,
    settings: ExactSettings,
    seed: int,
    *name: str | int,
) -> tuple[ExactPosterior, tuple[float, ...]]:
    """Draw from the exact posterior of a recording.

    Rounds of weighted draws begin with the network's, or with the prior's where there is no network. Where
    their weights fail the criteria after the last round, MCMC started from them takes over. A sampler that
    does not converge gives its draws all the same, and ``converged`` and ``reasons`` say so.

    Args:
        model: Prior and exact likelihood.
        network: The network's posterior of this recording; None: from the prior on.
        settings: Sizes and criteria.
        seed: Seed of everything.
        name: Names the streams.

    Returns:
        The posterior, with the network's or the prior's own draws beside it, and the efficiency of all draws
        after each round, the network's own first.

    Raises:
        NoLikelihoodError: The likelihood is zero at every draw of the first round.
    """
    seeds = [integer_seed(seed, *name, part) for part in ("rounds", "exact", "npe")]
    rounds = list(adaptive_rounds(model, settings, seeds[0], network))
    exact = certified(model, rounds[-1].weighted, settings, seeds[1])
    first = PriorProposal(model.settings.prior) if network is None else network
    efficiency = tuple(draws.weighted.efficiency for draws in rounds)
    return replace(exact, npe_phi=first.draw(settings.draws, seeds[2])), efficiency


def certified(
    model: LikelihoodModel, weighted: WeightedDraws, settings: ExactSettings, seed: int
) -> ExactPosterior:
    """Return equal draws of the posterior: of the weights where these are reliable, and else of MCMC.

    Args:
        model: Prior and exact likelihood.
        weighted: Draws with their weights; MCMC starts from them.
        settings: Sizes and criteria.
        seed: Seed of everything.
    """
    limit = k_hat_limit(len(weighted.phi), settings.max_k_hat)
    if reasons := weight_failures(weighted, limit, settings.min_effective_draws):
        return _by_mcmc(model, weighted, limit, reasons, settings, seed)
    return ExactPosterior(
        phi=resample(weighted, settings.draws, generator(seed, "exact", "resampling")),
        sampler="importance",
        reasons=(),
        k_hat_limit=limit,
        npe_phi=np.empty((0, weighted.phi.shape[1])),
        weighted=weighted,
        r_hat=np.full(weighted.phi.shape[1], np.nan),
        effective_draws=np.full(weighted.phi.shape[1], weighted.efficiency * len(weighted.phi)),
        mcmc_steps=0,
        converged=True,
    )


def weighted_posterior(
    model: LikelihoodModel,
    network: PlacedProposal,
    effective_draws: int,
    settings: ExactSettings,
    seed: int,
) -> tuple[WeightedDraws, bool]:
    """Return the exact posterior of a recording by as few weighted draws as a check of it needs.

    Rounds of weighted draws go on until their weights are reliable, as in a posterior that is reported, with
    so many effective draws; where they never are, MCMC started from them takes over. None is left out.

    Args:
        model: Prior and exact likelihood.
        network: The network's posterior.
        effective_draws: Effective draws that are enough.
        settings: The study's own criteria.
        seed: Seed of everything.

    Returns:
        The draws, and whether they are MCMC's: then of equal weight, with Pareto shape, efficiency and
        evidence of the weights that were not reliable.
    """
    wanted = asking(settings, effective_draws)
    weighted = adapted(model, wanted, integer_seed(seed, "rounds"), network).weighted
    limit = k_hat_limit(len(weighted.phi), wanted.max_k_hat)
    if not weight_failures(weighted, limit, wanted.min_effective_draws):
        return weighted, False
    posterior = certified(model, weighted, wanted, seed)
    count = len(posterior.phi)
    drawn = replace(
        weighted,
        phi=posterior.phi,
        from_prior=np.zeros(count, dtype=bool),
        log_likelihood=model.log_likelihood(posterior.phi),
        log_weight=np.log(equal_weights(count)),
    )
    return drawn, True


def weight_failures(weighted: WeightedDraws, limit: float, min_effective: float) -> tuple[str, ...]:
    """Return why weights are not reliable, a sentence for each criterion that fails."""
    effective = weighted.efficiency * len(weighted.phi)
    reasons = []
    if not weighted.k_hat <= limit:
        reasons.append(f"the Pareto shape of the weights is {weighted.k_hat:.2f}, above {limit:.2f}")
    if not effective >= min_effective:
        draws = len(weighted.phi)
        reasons.append(
            f"{effective:.0f} of {draws} weighted draws are effective, fewer than {min_effective:.0f}"
        )
    return tuple(reasons)


def _by_mcmc(
    model: LikelihoodModel,
    weighted: WeightedDraws,
    limit: float,
    reasons: tuple[str, ...],
    settings: ExactSettings,
    seed: int,
) -> ExactPosterior:
    rng = generator(seed, "exact", "mcmc")
    start = starting_points(model, weighted, settings.mcmc.start_points, rng)
    sampled = sample_mcmc(model, start, settings.mcmc, integer_seed(seed, "exact", "mcmc"))
    return ExactPosterior(
        phi=sampled.thinned(settings.draws, rng),
        sampler="mcmc",
        reasons=reasons + mcmc_failures(sampled, settings.mcmc),
        k_hat_limit=limit,
        npe_phi=np.empty((0, weighted.phi.shape[1])),
        weighted=weighted,
        r_hat=sampled.r_hat,
        effective_draws=sampled.effective_draws,
        mcmc_steps=sampled.steps,
        converged=sampled.converged,
    )


def mcmc_failures(sampled: McmcDraws, settings: McmcSettings) -> tuple[str, ...]:
    """Return what a sampler missed, as a sentence; empty where it converged."""
    if sampled.converged:
        return ()
    return (
        f"MCMC has not converged after {sampled.steps} steps: R-hat is {sampled.r_hat.max():.4f} (below "
        f"{settings.max_r_hat:g} is needed) with {sampled.effective_draws.min():.0f} effective draws "
        f"({settings.min_effective_draws} are needed)",
    )


def _nuisances(along: str) -> dict[str, Variable]:
    """Return the dataset of nuisance parameters, of which an experiment has as many as its prior frees."""
    meaning = "nuisance parameters, integrated out of the rest"
    return {NUISANCE_PARAMETERS: Variable(f"{along} {NUISANCE}", NUISANCE_COLUMNS, meaning)}


OWN: Final = schema_of(ExactPosterior)
SCHEMA: Final = {
    "/": arranged(
        OWN["/"]
        | {
            "reasons": Variable(
                "", "1", "why the weights were not used, what the sampler missed; or empty", after="converged"
            ),
        }
    ),
    "posterior": truncated.columns_along("chain draw", SCALE_NAME) | _nuisances("chain draw"),
    NPE: truncated.columns_along("draw", PHI_NAMES, ", of the network") | _nuisances("draw"),
    PRIOR_DRAWS: truncated.columns_along("draw", PHI_NAMES, ", of the prior") | _nuisances("draw"),
    "weighted": truncated.columns_along("draw", PHI_NAMES) | _nuisances("draw") | OWN["weighted"],
}
"""What ``posterior.h5`` of such an experiment has beside the groups and datasets of every posterior.

Of the network's draws and the prior's it has one: those with which the inference began.
"""


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
        z_obs: Conditioning vector of the network, shape (C,); empty where there was none.
        component_names: Names of its components.
        prior: The joint prior.
        settings: Gives the interval's mass.
    """
    groups = truncated.posterior_to_groups(_summary(exact, z_obs, component_names, prior, settings))
    groups["/"] = xr.merge([groups["/"], _root(exact, prior)], combine_attrs="no_conflicts")
    labels = {NUISANCE: list(prior.nuisance_names)}
    beside = _columns(exact.phi[None], SCALE_NAME)
    added = build_dataset(SCHEMA["posterior"], beside, labels)
    groups["posterior"] = groups["posterior"].assign(added.variables)
    first = group_of_first(len(z_obs))
    groups[first] = build_dataset(SCHEMA[first], _columns(exact.npe_phi, PHI_NAMES), labels)
    weighted = _columns(exact.weighted.phi, PHI_NAMES) | values_of(exact)["weighted"]
    groups["weighted"] = build_dataset(SCHEMA["weighted"], weighted, labels)
    return groups


def _columns(phi: FloatArray, names: Sequence[str]) -> dict[str, FloatArray]:
    """Return columns of phi (..., d): the last of those reported by name, and the nuisance parameters."""
    reported = phi[..., REPORTED][..., -len(names) :]
    return truncated.columns_of(reported, names) | {NUISANCE_PARAMETERS: phi[..., REPORTED.stop :]}


def read_exact_posterior(path: Path) -> ExactPosterior:
    """Read what ``posterior.h5`` of an experiment on speeds holds beside the posterior of theta.

    Raises:
        ArtefactError: The file is not a posterior.
        KeyError: It is the posterior of an experiment without an exact likelihood.
    """
    root, _ = load(path, truncated.POSTERIOR)
    first = group_of_first(root.sizes["component"])
    groups = {group: load(path, truncated.POSTERIOR, group)[0] for group in ("posterior", first, "weighted")}
    groups["/"] = root
    reasons = str(root["reasons"].item())
    given = {
        "phi": phi_of(groups["posterior"].isel(chain=0)),
        "reasons": tuple(reasons.split(SEPARATOR)) if reasons else (),
        "npe_phi": phi_of(groups[first]),
        "weighted.phi": phi_of(groups["weighted"]),
    }
    return from_groups(ExactPosterior, groups, given)


def _summary(
    exact: ExactPosterior,
    z_obs: FloatArray,
    component_names: tuple[str, ...],
    prior: JointPriorSettings,
    settings: ExactSettings,
) -> truncated.Posterior:
    """Return the posterior of theta; its candidates are the network's draws, none of which can leak."""
    kept = PosteriorSettings(
        draws=settings.draws, unfiltered_draws=settings.draws, interval=settings.interval
    )
    summary = truncated.summarise_posterior(exact.phi[:, OF_THETA], z_obs, component_names, prior.theta, kept)
    npe = exact.npe_phi[:, OF_THETA]
    return replace(summary, unfiltered=npe, unfiltered_in_prior=np.ones(len(npe), dtype=bool))


def _root(exact: ExactPosterior, prior: JointPriorSettings) -> xr.Dataset:
    values = values_of(exact)["/"] | {"reasons": SEPARATOR.join(exact.reasons)}
    return build_dataset(SCHEMA["/"], values, {"joint_parameter": list(prior.names)})
