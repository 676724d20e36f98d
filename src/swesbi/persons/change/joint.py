"""The joint posterior of two visits of one person, and all that is reported of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.measurement.likelihood import SpeedModel
from swesbi.persons.change.one_person import OnePerson, judge_one_person, normal_visit
from swesbi.persons.change.proposal import joined_proposal
from swesbi.persons.change.ratios import Ratios, log_ratios, quantities_of, summarise_ratios
from swesbi.persons.change.settings import ChangeSettings
from swesbi.persons.change.visits import VisitsModel, visits_model
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.space import Space
from swesbi.recording.observation import Observation
from swesbi.seeds import generator

STREAM: Final = "change"


@dataclass(frozen=True)
class OwnPosterior:
    """The exact posterior of one visit by itself.

    Attributes:
        phi: Equally weighted draws; shape (m, d).
        effective_draws: Behind them.
        log_evidence: Of its recording.
        space: In which the posterior of its heart is near normal: the base space of the network's flow.
    """

    phi: FloatArray
    effective_draws: float
    log_evidence: float
    space: Space


@dataclass(frozen=True)
class Change:
    """What two visits of one person say together.

    Attributes:
        exact: The joint posterior, in psi.
        phi: Its draws; shape (2, n, d).
        quantities: Theta and peak active stiffness of each; NaN where there is no beat; shape (2, n, 4).
        ratios: Of the later visit to the earlier.
        one_person: Whether both can be of one person.
        efficiency: Of all draws after each round, of the first proposal first.
    """

    exact: ExactPosterior
    phi: FloatArray
    quantities: FloatArray
    ratios: Ratios
    one_person: OnePerson
    efficiency: tuple[float, ...]


def own_posterior(exact: ExactPosterior, space: Space) -> OwnPosterior:
    """Return what the joint posterior begins with: a visit's own, and the space of its network."""
    by_weights = exact.sampler == "importance"
    effective = exact.efficiency * len(exact.weighted.phi) if by_weights else exact.effective_draws.min()
    return OwnPosterior(exact.phi, float(min(effective, len(exact.phi))), exact.log_evidence, space)


def both_visits(
    models: Sequence[SpeedModel], observed: Sequence[Observation], settings: ChangeSettings
) -> VisitsModel:
    """Return the model of two visits of one person, in what they share as configured."""
    shares = settings.shares
    return visits_model(
        models,
        [each.phase_index[each.measured] for each in observed],
        shares.of(models[0].settings.prior.names),
        shares.discrepancy,
    )


def infer_change(
    model: VisitsModel, own: Sequence[OwnPosterior], settings: ChangeSettings, seed: int, *name: str | int
) -> Change:
    """Infer two visits together, from what each says by itself.

    Args:
        model: Both recordings.
        own: The posterior of each by itself, in the same order.
        settings: Rule, effort.
        seed: The study's seed.
        name: Names the random streams: the person, say.

    Raises:
        NoLikelihoodError: The likelihood is zero at every draw of a round.
        ValueError: There are not two visits, or no draw has a beat at both.
    """
    if len(model.models) != 2 or len(own) != 2:
        raise ValueError(f"{len(model.models)} visits: a change is between two")
    first = joined_proposal(model, [each.phi for each in own], [each.space for each in own])
    exact, efficiency = exact_posterior(model, first, settings.exact, seed, STREAM, *name)
    phi = model.coupling.phi(exact.phi)
    quantities = np.stack([quantities_of(one, rows) for one, rows in zip(model.models, phi, strict=True)])
    rng = generator(seed, STREAM, *name, "independent")
    joint, independent = log_ratios(list(quantities)), log_ratios(_independent(model, own, rng))
    return Change(
        exact=exact,
        phi=phi,
        quantities=quantities,
        ratios=summarise_ratios(joint, independent, settings.exact.interval, settings.rule),
        one_person=judge_one_person(
            [normal_visit(each.phi, model.of_one, each.effective_draws) for each in own],
            model.coupling.shares,
            exact.log_evidence - sum(each.log_evidence for each in own),
            settings.rule.one_person_level,
            settings.rule.null_draws,
            rng,
        ),
        efficiency=efficiency,
    )


def _independent(
    model: VisitsModel, own: Sequence[OwnPosterior], rng: np.random.Generator
) -> list[FloatArray]:
    """Return the quantities of both visits' own draws, paired at random."""
    draws = min(len(each.phi) for each in own)
    return [
        quantities_of(one, each.phi[rng.permutation(len(each.phi))[:draws]])
        for one, each in zip(model.models, own, strict=True)
    ]
