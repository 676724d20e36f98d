"""The exact posterior of one recording, with its sampling check, and its file ``posterior.h5``.

The file is a posterior like any other, for :class:`swesbi.posterior.truncated.Posterior` and whatever reads
it. Beside it stand the passive stiffness, the weights and how the draws were obtained. It is read
without the libraries that made it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Final, Literal

import numpy as np

from swesbi.artefacts import (
    Artefact,
    Group,
    Labels,
    Part,
    Provenance,
    Variable,
    arranged,
    build_group,
    from_groups,
    schema_of,
    values_of,
)
from swesbi.artefacts.schema import Schema
from swesbi.base.arrays import FloatArray
from swesbi.parameters import NUISANCE_COLUMNS, OF_INTEREST, OF_THETA, PHI_NAMES
from swesbi.posterior import truncated
from swesbi.posterior.importance import WeightedDraws
from swesbi.posterior.truncated import Posterior, summary_of

Sampler = Literal["importance", "mcmc"]
MCMC: Final = "mcmc"
NUISANCE_PARAMETERS: Final = "nuisance_parameters"
"""The dataset of the nuisance parameters in each group of draws."""
PROPOSAL: Final = "proposal"
"""The group of the draws with which the inference began: of the network, or without one of the prior."""
SCALE_NAME: Final = PHI_NAMES[-1:]
NUISANCE: Final = "nuisance"
SEPARATOR: Final = "; "


@dataclass(frozen=True)
class ExactPosterior(Artefact):
    """Equally weighted draws of the exact posterior of one recording, and how they were obtained.

    phi is (n, d). ``reasons`` say why the weights were not used, and what the sampler then missed.
    ``proposal_phi`` (m, d) are draws of the network as they came, or of the prior where there is none; what
    it does not propose is drawn given the recording. The conditioning vector (C,) is empty without a
    network. ``converged``: the weights are reliable, or a sampler reached its R-hat and effective draws.
    """

    phi: FloatArray
    sampler: Annotated[Sampler, Variable("", "1", "what gave the draws: importance or mcmc")]
    reasons: tuple[str, ...]
    k_hat_limit: Annotated[
        float, Variable("", "1", "largest Pareto shape of reliable weights", after="k_hat")
    ]
    proposal_phi: FloatArray
    weighted: Annotated[WeightedDraws, Part()]
    r_hat: Annotated[
        FloatArray,
        Variable("joint_parameter", "1", "rank-normalised split R-hat; NaN: integrated out, or no MCMC"),
    ]
    effective_draws: Annotated[
        FloatArray, Variable("joint_parameter", "1", "effective number behind the draws")
    ]
    mcmc_steps: Annotated[int, Variable("", "1", "steps of each walker, warm-up included; 0 without MCMC")]
    converged: Annotated[
        bool, Variable("", "1", "1 where weights or sampler are reliable, else 0", after="sampler")
    ]
    interval_mass: float
    condition: FloatArray
    components: tuple[str, ...] = ()
    parameters: Annotated[tuple[str, ...], Labels("joint_parameter")] = ()

    kind = Posterior.kind
    labels = Posterior.labels

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

    @property
    def by_mcmc(self) -> bool:
        """Whether the sampler, and not the weights, gave the draws."""
        return self.sampler == MCMC

    @property
    def doubts(self) -> tuple[str, ...]:
        """What the draws missed, in sentences; none where they converged."""
        return () if self.converged else self.reasons

    @property
    def largest_r_hat(self) -> float:
        """Largest split R-hat of the sampler over the parameters; NaN without one."""
        return float(np.fmax.reduce(self.r_hat))

    def to_groups(self) -> dict[str, Group]:
        """Return the groups of the file."""
        groups = _summary(self).to_groups()
        groups["/"] = groups["/"].joined(_root(self))
        labels = {NUISANCE: list(self.parameters[OF_INTEREST.stop :])}
        beside = _columns(self.phi[None], SCALE_NAME)
        added = build_group(SCHEMA["posterior"], beside, labels)
        groups["posterior"] = groups["posterior"].joined(added)
        groups[PROPOSAL] = build_group(SCHEMA[PROPOSAL], _columns(self.proposal_phi, PHI_NAMES), labels)
        weighted = _columns(self.weighted.phi, PHI_NAMES) | values_of(self)["weighted"]
        groups["weighted"] = build_group(SCHEMA["weighted"], weighted, labels)
        return groups

    @classmethod
    def schema(cls) -> Schema:
        """Return groups and datasets of the file: of every posterior, and what it has beside them."""
        of_all = Posterior.schema()
        return {**of_all, **{group: {**of_all.get(group, {}), **own} for group, own in SCHEMA.items()}}

    @classmethod
    def rebuilt(cls, groups: Mapping[str, Group], made: Provenance) -> ExactPosterior:
        """Return what the groups of ``posterior.h5`` of an experiment on speeds hold."""
        root = groups["/"]
        reasons = str(root["reasons"].item())
        given = {
            "phi": phi_of(groups["posterior"].at("chain", 0)),
            "reasons": tuple(reasons.split(SEPARATOR)) if reasons else (),
            "proposal_phi": phi_of(groups[PROPOSAL]),
            "weighted.phi": phi_of(groups["weighted"]),
            "interval_mass": float(root["interval_mass"].item()),
            "condition": root["z_obs"].to_numpy(),
            "components": tuple(root["component"].to_numpy().tolist()),
        }
        return from_groups(cls, groups, given)


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
                "",
                "1",
                "why the weights were not used, what the sampler missed; or empty",
                after="converged",
                text=True,
            ),
        }
    ),
    "posterior": truncated.columns_along("chain draw", SCALE_NAME) | _nuisances("chain draw"),
    PROPOSAL: truncated.columns_along("draw", PHI_NAMES, ", of the proposal") | _nuisances("draw"),
    "weighted": truncated.columns_along("draw", PHI_NAMES) | _nuisances("draw") | OWN["weighted"],
}
"""What ``posterior.h5`` of such an experiment has beside the groups and datasets of every posterior.
"""


def phi_of(group: Group) -> FloatArray:
    """Return the draws of a group: what is reported by name, nuisance parameters behind it; shape (n, d)."""
    reported = np.stack([group[name].to_numpy() for name in PHI_NAMES], axis=-1)
    return np.hstack([reported, group[NUISANCE_PARAMETERS].to_numpy()])


def _columns(phi: FloatArray, names: Sequence[str]) -> dict[str, FloatArray]:
    """Return columns of phi (..., d): the last of those reported by name, and the nuisance parameters."""
    reported = phi[..., OF_INTEREST][..., -len(names) :]
    return truncated.columns_of(reported, names) | {NUISANCE_PARAMETERS: phi[..., OF_INTEREST.stop :]}


def _summary(exact: ExactPosterior) -> Posterior:
    """Return the posterior of theta; its candidates are the network's draws, none of which can leak."""
    npe, inside = exact.proposal_phi[:, OF_THETA], np.ones(len(exact.proposal_phi), dtype=bool)
    theta = np.ascontiguousarray(exact.phi[:, OF_THETA])  # sums, to the last bit, follow the memory
    return summary_of(theta, npe, inside, exact.condition, exact.components, interval=exact.interval_mass)


def _root(exact: ExactPosterior) -> Group:
    values = values_of(exact)["/"] | {"reasons": SEPARATOR.join(exact.reasons)}
    return build_group(SCHEMA["/"], values, {"joint_parameter": list(exact.parameters)})
