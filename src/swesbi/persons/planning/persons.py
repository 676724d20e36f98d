"""Persons of a planned study: drawn as those of the virtual trial, recorded with the effect and without.

Both recordings have the same heart rate, errors of clinical measures and noise of repeats and samples: nobody
is ever in one study twice, and what both have in common says how a bank errs (``planning.likelihoods``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.parameters import THETA_NAMES
from swesbi.persons.planning.effect import Effect
from swesbi.persons.planning.settings import PAIRED, PlannedPersonsSettings
from swesbi.population.contexts import draw_one
from swesbi.prior import sample
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import Observation
from swesbi.seeds import generator
from swesbi.virtual.trial.persons import (
    MAX_ATTEMPTS,
    DrawnAgain,
    at_visit,
    check_bounds,
    phi_at_visit,
    record_visit,
)
from swesbi.virtual.trial.settings import AFTER, BEFORE, CONTROL, TrialSettings
from swesbi.virtual.trial.source import MECHANICS, TrialSource, narrowed

STREAM = "plan"
Theta = Mapping[str, float]


@dataclass(frozen=True)
class PlannedPerson:
    """One person of a bank, recorded.

    Attributes:
        number: Of the person.
        earlier: The visit before, of those who come twice; else None.
        arms: The visit without the effect and with it.
        theta_earlier: True theta at the visit before; of those who come once, ones; shape (3,).
        theta: True theta of both arms; shape (2, 3).
        redrawn: Persons who were drawn in this place before and did not take part.
    """

    number: int
    earlier: Observation | None
    arms: tuple[Observation, Observation]
    theta_earlier: FloatArray
    theta: FloatArray
    redrawn: int


def trial_of(persons: PlannedPersonsSettings) -> TrialSettings:
    """Return the persons of a bank as those of a trial, whose treatment the bank puts in by itself."""
    return TrialSettings(
        persons_per_group=persons.number,
        population_group=persons.group,
        prior_share=persons.prior_share,
        theta_spread=persons.visit_spread,
        passive_spread=persons.passive_spread,
        loading_spread=persons.loading_spread,
        heart_rate_spread=persons.heart_rate_spread,
        kept_scale_share=persons.kept_scale_share,
        weeks_between=persons.weeks_between,
        effect={},
        ejection_fraction=persons.ejection_fraction,
    )


def trial_model(model: SpeedModelSettings, persons: PlannedPersonsSettings) -> SpeedModelSettings:
    """Return what makes the persons: richer mechanics than the inference's, and a narrower prior."""
    return model.model_copy(
        update={
            "prior": narrowed(model.prior, persons.prior_share),
            "forward_model": MECHANICS,
        }
    )


def draw_planned(
    number: int, design: str, effect: Effect, response_spread: float, source: TrialSource
) -> PlannedPerson:
    """Draw the person of this number, whatever the others; who does not take part is drawn again.

    Args:
        number: Of the person.
        design: ``paired``: with a visit before; ``groups``: without.
        effect: On the middle person.
        response_spread: Of the logarithm of the effect between persons.
        source: What persons are drawn with.

    Raises:
        ValueError: Nobody took part in many draws.
    """
    reasons = []
    for attempt in range(MAX_ATTEMPTS):
        try:
            person = _drawn(number, design, effect, response_spread, source, (number, attempt))
        except DrawnAgain as reason:
            reasons.append(str(reason))
        else:
            return replace(person, redrawn=attempt)
    raise ValueError(
        f"person {number} of the bank: nobody took part in {MAX_ATTEMPTS} draws, for {sorted(set(reasons))}; "
        f"an effect of {effect.words} may lie beyond the prior's bounds: name a smaller one"
    )


def _drawn(
    number: int,
    design: str,
    effect: Effect,
    response_spread: float,
    source: TrialSource,
    stream: tuple[int, int],
) -> PlannedPerson:
    rng = generator(source.seed, STREAM, "person", *stream)
    context = draw_one(number, source.population, rng).context
    own = dict(zip(source.model.prior.names, sample(1, source.model.prior, rng)[0].tolist(), strict=True))
    earlier, before = None, dict.fromkeys(THETA_NAMES, 1.0)
    if design == PAIRED:
        before = phi_at_visit(own, BEFORE, CONTROL, source, rng)
        earlier = _observed(context, BEFORE, before, f"{number}-before", source, rng)
    visit = AFTER if design == PAIRED else BEFORE
    phi = phi_at_visit(own, visit, CONTROL, source, rng)
    response = effect.factor * float(np.exp(response_spread * rng.standard_normal()))
    changed = phi | {effect.parameter: response * phi[effect.parameter]}
    check_bounds(changed, source.bounds)
    # Both arms have one day and one noise: what the bank errs by is the same in both, and known from one.
    day, same_day = (generator(source.seed, STREAM, "recording", *stream) for _ in range(2))
    arms = (
        _observed(context, visit, phi, f"{number}-none", source, day),
        _observed(context, AFTER, changed, f"{number}-effect", source, same_day),
    )
    return PlannedPerson(number, earlier, arms, _theta(before), np.stack([_theta(phi), _theta(changed)]), 0)


def _observed(
    context: Context, visit: str, phi: Theta, name: str, source: TrialSource, rng: np.random.Generator
) -> Observation:
    """Record a visit and ingest it; a visit after the first need not have the ejection fraction of health."""
    of_day = replace(at_visit(context, visit, source, rng), subject=f"plan-{name}")
    made = record_visit(of_day, visit, phi, source, rng)
    return ingest(made.samples, made.context, source.recording, source.grid_points)


def _theta(phi: Theta) -> FloatArray:
    return np.array([phi[name] for name in THETA_NAMES])
