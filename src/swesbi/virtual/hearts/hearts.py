"""The hearts that this program simulates, by letter: volunteers elsewhere, or of another structure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.heart.model import activation_duration_s, isometric_stiffness_kpa
from swesbi.heart.periodic import Status
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import Beats, simulate
from swesbi.measurement.operator import active_stiffness_map, passive_shape
from swesbi.population.settings import PopulationSettings
from swesbi.prior import PriorSettings
from swesbi.recording.acquisition import TruthCurve
from swesbi.recording.acquisition_settings import AcquisitionSettings
from swesbi.virtual.generated import PHYSIOLOGY, Range, draw_context, volunteer_in
from swesbi.virtual.hearts.echocardiography import with_own_lvesv
from swesbi.virtual.hearts.heart import K_SR, OtherHeart
from swesbi.virtual.hearts.passive import (
    acoustoelastic_kpa,
    fung_tangent,
    incremental_modulus_kpa,
    mooney_rivlin_wall,
    parabola,
    powers,
    recruited,
)
from swesbi.virtual.hearts.ranges import (
    DOUBLED,
    SHAPE_FACTOR,
    DrawContext,
    from_population,
    log_uniform,
    louder,
    other_mechanics,
    with_extremes,
)
from swesbi.virtual.volunteers import Volunteer, designed_scale, forward_model_of

PassiveShape = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Structure:
    """What a heart is that a volunteer is not.

    Attributes:
        forward_model: Settings of the forward model that differ from the volunteer's.
        passive_shape: Passive stiffness up to its scale, of the stretch; None: that of the volunteers.
        map_name: Map from active stiffness to what elastography shows of it.
        own_law: Whether k_0, k_ATP and k_SR mean what they mean in the inference model.
    """

    forward_model: Mapping[str, object]
    passive_shape: PassiveShape | None = None
    map_name: str = "identity"
    own_law: bool = True


DrawStructure = Callable[[Volunteer, np.random.Generator], Structure]


@dataclass(frozen=True)
class SimulatedHearts:
    """Hearts of one letter.

    Attributes:
        letter: The letter.
        title: What they are.
        contexts: Draws their contexts.
        physiology: Ranges in which their physiology is uniform.
        structure: Draws what else differs.
        prior: Of theta.
        acquisition: How they are recorded.
        lvesv_fraction: Standard deviation of the logarithm of a measured LVESV.
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

        Raises:
            RuntimeError: It has no periodic beat, cannot be as stiff as designed, or ejects too little for
                ingestion.
        """
        context = self.contexts(index, rng)
        volunteer = volunteer_in(context, self.physiology, self.prior, self.acquisition, rng)
        heart = heart_of(volunteer, self.structure(volunteer, rng))
        return replace(heart, context=with_own_lvesv(context, heart.volume_ratio, self.lvesv_fraction, rng))


def heart_of(volunteer: Volunteer, structure: Structure) -> OtherHeart:
    """Simulate a heart and set its passive scale so that late diastole is as stiff as designed.

    Raises:
        RuntimeError: It has no periodic beat, or its active part alone is stiffer there.
    """
    settings = changed_model(volunteer, structure.forward_model)
    beats = simulate(np.array([volunteer.theta]), volunteer.context, settings)
    if beats.status[0] != Status.PERIODIC:
        raise RuntimeError(f"{volunteer.context.subject}: {Status(beats.status[0]).name}")
    theta, bonds_kpa = np.array(volunteer.theta), beats.active_stiffness_kpa[0]
    duration_s = activation_duration_s(volunteer.context.period_s, settings)
    return OtherHeart(
        context=volunteer.context,
        curve=_curve(volunteer, structure, beats),
        theta=theta if structure.own_law else None,
        k_sr_per_s=float(theta[K_SR]),
        active_kpa=active_stiffness_map(structure.map_name)(bonds_kpa),
        isometric_kpa=float(isometric_stiffness_kpa(theta[None], duration_s)[0])
        if structure.own_law
        else None,
        volume_ratio=float(beats.end_systolic_volume_ml[0] / beats.end_diastolic_volume_ml[0]),
    )


def changed_model(volunteer: Volunteer, changes: Mapping[str, object]) -> ForwardModelSettings:
    """Return the volunteer's forward model with other settings."""
    return ForwardModelSettings.from_plain({**forward_model_of(volunteer).to_plain(), **changes})


def _curve(volunteer: Volunteer, structure: Structure, beats: Beats) -> TruthCurve:
    shape_of = structure.passive_shape or (
        lambda stretch: passive_shape(stretch, volunteer.passive_exponent_b)
    )
    shown = active_stiffness_map(structure.map_name)(beats.active_stiffness_kpa[0])
    shape = shape_of(beats.stretch[0])
    scale = designed_scale(volunteer.late_diastolic_kpa, beats.cycle_phase, shown, shape)
    if scale <= 0.0:
        raise RuntimeError(
            f"{volunteer.context.subject}: active in late diastole beyond the designed stiffness"
        )
    return TruthCurve(beats.cycle_phase, scale * shape + shown)


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

    Half of the walls are of Mooney-Rivlin, the others of the exponential law with fibres, which is
    Holzapfel's. The stretch's excursion from one is scaled.
    """
    own = changed_model(volunteer, {})
    changes = mooney_rivlin_wall(own) if rng.random() < 0.5 else {}
    factor, settings = float(rng.uniform(*SHAPE_FACTOR)), changed_model(volunteer, changes)

    def shape(stretch: FloatArray) -> FloatArray:
        return incremental_modulus_kpa(1.0 + factor * (stretch - 1.0), settings)

    return Structure(changes, passive_shape=shape)


def with_fung_tangent(volunteer: Volunteer, rng: np.random.Generator) -> Structure:
    """Return a passive stiffness that rises in compression as in stretch; it is of development."""
    return Structure({}, passive_shape=lambda stretch: fung_tangent(stretch, volunteer.passive_exponent_b))


def with_recruited_collagen(volunteer: Volunteer, rng: np.random.Generator) -> Structure:
    """Return collagen that stretch recruits in a matrix that resists compression; it is of development."""
    exponent, share, resistance = rng.uniform(3.0, 12.0), rng.uniform(0.2, 0.8), rng.uniform(0.0, 10.0)
    return Structure({}, passive_shape=lambda stretch: recruited(stretch, exponent, share, resistance))


def with_parabola(volunteer: Volunteer, rng: np.random.Generator) -> Structure:
    """Return a parabola in stretch, softest anywhere about rest; it is of development."""
    softest, rise = rng.uniform(0.93, 1.05), log_uniform((10.0, 150.0), rng)
    return Structure({}, passive_shape=lambda stretch: parabola(stretch, softest, rise))


def with_powers(volunteer: Volunteer, rng: np.random.Generator) -> Structure:
    """Return powers of the stretch; it is of development."""
    tensile, compressive, ratio = rng.uniform(0.0, 14.0), rng.uniform(0.0, 12.0), log_uniform((0.2, 3.0), rng)
    return Structure({}, passive_shape=lambda stretch: powers(stretch, tensile, compressive, ratio))


def with_acoustoelasticity(volunteer: Volunteer, rng: np.random.Generator) -> Structure:
    """Return the passive stiffness that a wave meets in the stretched wall; it is of development."""
    own = changed_model(volunteer, {})
    return Structure({}, passive_shape=lambda stretch: acoustoelastic_kpa(stretch, own))


def of_other_mechanics(volunteer: Volunteer, rng: np.random.Generator) -> Structure:
    """Return a thin wall, the second measure of stress, a proximal capacitance; it is of development."""
    return Structure(
        {"geometry": "thin", "stress_measure": "second_piola", "proximal_capacitance_m3_pa": 2e-10}
    )


def simulated_generators(
    population: PopulationSettings,
    prior: PriorSettings,
    acquisition: AcquisitionSettings,
    lvesv_fraction: float,
) -> dict[str, SimulatedHearts]:
    """Return the generators that this program simulates, those of development among them, by letter.

    (g) is among them where the prior frees the scale of the speeds, without which nothing is assumed of it.

    Args:
        population: Whom contexts are drawn from.
        prior: Of theta and of the scale of the speeds.
        acquisition: How hearts are recorded, but those of (g).
        lvesv_fraction: Standard deviation of the logarithm of a measured LVESV.
    """
    people = from_population(population)
    rows: dict[str, tuple[str, DrawContext, Mapping[str, Range], DrawStructure]] = {
        "a": ("generator of the study", draw_context, PHYSIOLOGY, as_volunteers),
        "b": ("its ranges doubled", with_extremes(population), DOUBLED, as_volunteers),
        "c": ("length dependence, inertance, viscosity", people, PHYSIOLOGY, with_length_dependence),
        "d": ("spring in series", people, PHYSIOLOGY, with_series_spring),
        "h": ("another passive stiffness", people, PHYSIOLOGY, with_wall_tangent),
        "u": ("acoustoelastic wall", people, PHYSIOLOGY, with_acoustoelasticity),
        "v": ("recruited collagen", people, PHYSIOLOGY, with_recruited_collagen),
        "w": ("parabola in stretch", people, PHYSIOLOGY, with_parabola),
        "x": ("powers of stretch", people, PHYSIOLOGY, with_powers),
        "y": ("passive law of development", people, PHYSIOLOGY, with_fung_tangent),
        "z": ("structure of development", people, PHYSIOLOGY, of_other_mechanics),
    }
    acquisitions: dict[str, AcquisitionSettings] = {}
    if (speed_scale := prior.nuisances.speed_scale) is not None:
        rows["g"] = ("errors and scale doubled", people, PHYSIOLOGY, as_volunteers)
        acquisitions["g"] = louder(acquisition, speed_scale)
    return {
        letter: SimulatedHearts(letter, *row, prior, acquisitions.get(letter, acquisition), lvesv_fraction)
        for letter, row in sorted(rows.items())
    }
