"""The hearts that this program simulates, by letter: volunteers elsewhere, or of another structure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from studies.validation.hearts.heart import K_SR, OtherHeart
from studies.validation.hearts.passive import incremental_modulus_kpa, mooney_rivlin_wall
from studies.validation.hearts.ranges import (
    DOUBLED,
    SHAPE_FACTOR,
    DrawContext,
    from_population,
    louder,
    other_mechanics,
    with_extremes,
)
from swesbi.base.arrays import FloatArray
from swesbi.heart.model import activation_duration_s, isometric_stiffness_kpa
from swesbi.heart.periodic import Status
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import Beats, simulate
from swesbi.measurement.operator import active_stiffness_map, passive_shape
from swesbi.population.settings import PopulationSettings
from swesbi.prior import PriorSettings
from swesbi.recording.acquisition import TruthCurve
from swesbi.recording.settings import AcquisitionSettings
from swesbi.virtual.generated import PHYSIOLOGY, Range, draw_context, volunteer_in
from swesbi.virtual.volunteers import Volunteer, designed_scale, forward_model_of, with_own_lvesv

PassiveShape = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Structure:
    """What a heart is that a volunteer is not; the forward model's settings are those that differ.

    The passive shape is a stiffness up to its scale, of the stretch; None is the volunteers'. With
    ``own_law``, k_0, k_ATP and k_SR mean what they mean in the inference model.
    """

    forward_model: Mapping[str, object]
    passive_shape: PassiveShape | None = None
    map_name: str = "identity"
    own_law: bool = True


DrawStructure = Callable[[Volunteer, np.random.Generator], Structure]


@dataclass(frozen=True)
class SimulatedHearts:
    """Hearts of one letter; their physiology is uniform in its ranges.

    ``lvesv_fraction`` is the standard deviation of the logarithm of a measured LVESV.
    """

    letter: str
    title: str
    contexts: DrawContext
    physiology: Mapping[str, Range]
    structure: DrawStructure
    prior: PriorSettings
    acquisition: AcquisitionSettings
    lvesv_fraction: float

    def draw(self, index: int, rng: np.random.Generator) -> OtherHeart:
        """Return the heart of this number, drawn from ``rng`` alone.

        Without a periodic beat, the designed stiffness or enough ejection for ingestion: RuntimeError.
        """
        context = self.contexts(index, rng)
        volunteer = volunteer_in(context, self.physiology, self.prior, self.acquisition, rng)
        heart = heart_of(volunteer, self.structure(volunteer, rng))
        return replace(heart, context=with_own_lvesv(context, heart.volume_ratio, self.lvesv_fraction, rng))


def heart_of(volunteer: Volunteer, structure: Structure) -> OtherHeart:
    """Simulate a heart and set its passive scale so that late diastole is as stiff as designed.

    Where it has no periodic beat, or its active part alone is stiffer there, that is a RuntimeError.
    """
    settings = changed_model(volunteer, structure.forward_model)
    beats = simulate(np.array([volunteer.theta]), volunteer.context, settings)
    if beats.status[0] != Status.PERIODIC:
        raise RuntimeError(f"{volunteer.context.subject}: {Status(beats.status[0]).name}")
    theta, own_law = np.array(volunteer.theta), structure.own_law
    shown_kpa = active_stiffness_map(structure.map_name)(beats.active_stiffness_kpa[0])
    duration_s = activation_duration_s(volunteer.context.period_s, settings)
    isometric_kpa = float(isometric_stiffness_kpa(theta[None], duration_s)[0])
    return OtherHeart(
        context=volunteer.context,
        curve=_curve(volunteer, structure, beats, shown_kpa),
        theta=theta if own_law else None,
        k_sr_per_s=float(theta[K_SR]),
        active_kpa=shown_kpa,
        isometric_kpa=isometric_kpa if own_law else None,
        volume_ratio=float(beats.end_systolic_volume_ml[0] / beats.end_diastolic_volume_ml[0]),
    )


def changed_model(volunteer: Volunteer, changes: Mapping[str, object]) -> ForwardModelSettings:
    """Return the volunteer's forward model with other settings."""
    return ForwardModelSettings.from_plain({**forward_model_of(volunteer).to_plain(), **changes})


def _curve(volunteer: Volunteer, structure: Structure, beats: Beats, shown_kpa: FloatArray) -> TruthCurve:
    shape_of = structure.passive_shape or (
        lambda stretch: passive_shape(stretch, volunteer.passive_exponent_b)
    )
    shape = shape_of(beats.stretch[0])
    scale = designed_scale(volunteer.late_diastolic_kpa, beats.cycle_phase, shown_kpa, shape)
    if scale <= 0.0:
        raise RuntimeError(
            f"{volunteer.context.subject}: active in late diastole beyond the designed stiffness"
        )
    return TruthCurve(beats.cycle_phase, scale * shape + shown_kpa)


def as_volunteers(volunteer: Volunteer, rng: np.random.Generator) -> Structure:
    """Return the volunteers' own structure: valve inertance, wall inertia, a slow ramp of activation."""
    return Structure({})


def with_length_dependence(volunteer: Volunteer, rng: np.random.Generator) -> Structure:
    """Return length dependence, with which k_0 and k_ATP are of another law, and other mechanics."""
    return Structure(other_mechanics(rng), own_law=False)


def with_series_spring(volunteer: Volunteer, rng: np.random.Generator) -> Structure:
    """Return bonds whose stiffness shows through a spring in series."""
    return Structure({}, map_name="series_spring")


def with_wall_tangent(volunteer: Volunteer, rng: np.random.Generator) -> Structure:
    """Return a passive stiffness that is the incremental modulus of the wall's own energy.

    Half of the walls are of Mooney-Rivlin, the others of Holzapfel's exponential law with fibres. The
    stretch's excursion from one is scaled.
    """
    own = changed_model(volunteer, {})
    changes = mooney_rivlin_wall(own) if rng.random() < 0.5 else {}
    factor, settings = float(rng.uniform(*SHAPE_FACTOR)), changed_model(volunteer, changes)

    def shape(stretch: FloatArray) -> FloatArray:
        return incremental_modulus_kpa(1.0 + factor * (stretch - 1.0), settings)

    return Structure(changes, passive_shape=shape)


def simulated_generators(
    population: PopulationSettings,
    prior: PriorSettings,
    acquisition: AcquisitionSettings,
    lvesv_fraction: float,
) -> dict[str, SimulatedHearts]:
    """Return the generators that this program simulates, by letter; the acquisition is of all but (g).

    (g) is among them where the prior frees the scale of the speeds, without which nothing is assumed of it.
    ``lvesv_fraction`` is the standard deviation of the logarithm of a measured LVESV.
    """
    people = from_population(population)
    rows: dict[str, tuple[str, DrawContext, Mapping[str, Range], DrawStructure]] = {
        "a": ("generator of the study", draw_context, PHYSIOLOGY, as_volunteers),
        "b": (
            "generator of the study with doubled ranges",
            with_extremes(population),
            DOUBLED,
            as_volunteers,
        ),
        "c": ("length dependence, inertance, viscosity", people, PHYSIOLOGY, with_length_dependence),
        "d": ("spring in series", people, PHYSIOLOGY, with_series_spring),
        "h": ("another passive stiffness", people, PHYSIOLOGY, with_wall_tangent),
    }
    acquisitions: dict[str, AcquisitionSettings] = {}
    if (speed_scale := prior.nuisances.speed_scale) is not None:
        rows["g"] = (
            "generator of the study with doubled errors and scale",
            people,
            PHYSIOLOGY,
            as_volunteers,
        )
        acquisitions["g"] = louder(acquisition, speed_scale)
    return {
        letter: SimulatedHearts(letter, *row, prior, acquisitions.get(letter, acquisition), lvesv_fraction)
        for letter, row in sorted(rows.items())
    }
