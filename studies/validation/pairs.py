"""Persons of one generator, recorded twice: what a person keeps, what a visit has of its own.

The first visit is a heart of the generator. At the second visit theta, loading and heart rate are others; all
else is the person's, or is drawn anew in part, as a variant says. Two visits of strangers are two hearts in
one context. None of these hearts is of the validation itself: the streams have names of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from scipy.special import ndtr, ndtri

from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.heart.periodic import Status
from swesbi.heart.physiology import VOLUME_FACTOR, Physiology
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import Beats, simulate
from swesbi.measurement.operator import passive_shape
from swesbi.parameters import THETA_NAMES
from swesbi.population.contexts import is_plausible
from swesbi.population.settings import PopulationSettings, in_declared_range
from swesbi.prior import in_bounds
from swesbi.recording.acquisition import TruthCurve, acquire
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import Observation
from swesbi.recording.problems import RecordingError
from swesbi.recording.samples import Samples
from swesbi.recording.settings import RecordingSettings
from swesbi.seeds import generator
from swesbi.virtual.generated import Range, volunteer_in
from swesbi.virtual.hearts.echocardiography import with_own_lvesv
from swesbi.virtual.hearts.hearts import SimulatedHearts
from swesbi.virtual.hearts.ranges import log_uniform
from swesbi.virtual.volunteers import Volunteer, designed_scale, forward_model_of

MAX_ATTEMPTS: Final = 50
RESISTANCE, CAPACITANCE = "distal_resistance_pa_s_m3", "systemic_capacitance_m3_pa"
LATE_DIASTOLIC: Final = "late_diastolic_kpa"
ALPHA: Final = "destruction_alpha"


@dataclass(frozen=True)
class Spreads:
    """How a visit lies about the person's own: standard deviations of logarithms.

    Two visits of a person differ by the square root of two times as much.

    Attributes:
        heart_rate: Of the heart rate.
        loading: Of R_d, and of C_s.
        stressed_volume: Of the stressed volume.
    """

    heart_rate: float
    loading: float
    stressed_volume: float


@dataclass(frozen=True)
class Variant:
    """What the second visit of a pair has.

    Attributes:
        title: In a few words.
        theta_reach: Each of theta changes by a factor of its own, uniform in its logarithm between 1 / reach
            and reach; 1: none does.
        effect: Factors on parameters of theta, by name, the same in every pair.
        kept: Correlation of the scores of physiology and of the scale of the speeds between visits.
        alpha_factor: On alpha.
        half_still: Whether every other pair, beginning with the first, keeps its theta.
        strangers: Whether the second recording is of another heart, in the same context.
    """

    title: str
    theta_reach: float = 1.0
    effect: Mapping[str, float] = field(default_factory=dict)
    kept: float = 1.0
    alpha_factor: float = 1.0
    half_still: bool = False
    strangers: bool = False

    def keeps_theta(self, number: int) -> bool:
        """Return whether the pair of this number has one theta at both visits."""
        return not self.effect and (self.theta_reach == 1.0 or (self.half_still and number % 2 == 0))

    def theta_factors(self, number: int, rng: np.random.Generator) -> FloatArray:
        """Return what theta is multiplied by at the second visit of the pair of this number; shape (3,)."""
        reach = 1.0 if self.keeps_theta(number) else self.theta_reach
        drawn = np.array([log_uniform((1.0 / reach, reach), rng) for _ in THETA_NAMES])
        return np.asarray(drawn * [self.effect.get(name, 1.0) for name in THETA_NAMES])


REACH: Final = 1.5
"""Chosen: twice the 25 % of the changes that studies are planned for, either way."""
VARIANTS: Final[Mapping[str, Variant]] = {
    "changed": Variant("theta changed, physiology kept", theta_reach=REACH),
    "unchanged": Variant("theta and physiology kept"),
    "half_redrawn": Variant(
        "half of physiology and speed scale drawn anew", theta_reach=REACH, kept=0.5, half_still=True
    ),
    "drug_on_alpha": Variant("alpha times 1.2", theta_reach=REACH, alpha_factor=1.2, half_still=True),
    "strangers": Variant("two persons in one context", strangers=True),
    "power": Variant("k_SR times 0.75", effect={"k_sr_per_s": 0.75}),
}


@dataclass(frozen=True)
class VisitTruth:
    """What is true of a heart at a visit.

    Attributes:
        volunteer: Context, theta and physiology.
        stressed_volume_factor: Of the stressed volume that the volunteer starts with.
        passive_scale_kpa: a.
        speed_scale: Factor of all speeds.
    """

    volunteer: Volunteer
    stressed_volume_factor: float
    passive_scale_kpa: float
    speed_scale: float


@dataclass(frozen=True)
class RecordedVisit:
    """One visit: truth, largest true active stiffness in kPa, recording, and what ingestion makes of it."""

    truth: VisitTruth
    shown_kpa: float
    samples: Samples
    observation: Observation


@dataclass(frozen=True)
class PairSource:
    """What pairs are drawn with.

    Attributes:
        hearts: The generator.
        spreads: From visit to visit.
        population: Whose declared range no context leaves.
        recording: Quality control.
        grid_points: Size of the analysis grid that ingestion fills.
        seed: The study's seed.
        stream: Name of the random streams.
    """

    hearts: SimulatedHearts
    spreads: Spreads
    population: PopulationSettings
    recording: RecordingSettings
    grid_points: int
    seed: int
    stream: str


class DrawnAgain(Exception):
    """A visit that is none: no beat, or not one that the study admits; says why."""


DrawTruth = Callable[[np.random.Generator], VisitTruth]


def first_visit(source: PairSource, number: int) -> RecordedVisit:
    """Draw and record the first visit of the person of this number.

    Raises:
        RuntimeError: Nobody could be recorded in many draws.
    """
    contexts = source.hearts.contexts
    return _drawn(source, number, "first", lambda rng: _heart_in(contexts(number, rng), source, rng))


def second_visit(source: PairSource, number: int, name: str, first: RecordedVisit) -> RecordedVisit:
    """Draw and record the second visit of a pair of the variant ``name``.

    What has no beat, or a theta outside the prior's bounds, is drawn again, the first visit staying.

    Raises:
        RuntimeError: There is none in many draws.
    """
    variant, truth = VARIANTS[name], first.truth
    if variant.strangers:
        context = truth.volunteer.context
        return _drawn(source, number, name, lambda rng: _heart_in(context, source, rng))
    return _drawn(source, number, name, lambda rng: later_truth(truth, variant, number, source, rng))


def _drawn(source: PairSource, number: int, name: str, draw: DrawTruth) -> RecordedVisit:
    """Draw and record a visit from its own stream, again where it is none."""
    rng, subject = (
        generator(source.seed, source.stream, number, name),
        visit_name(source.stream, number, name),
    )
    why = []
    for _ in range(MAX_ATTEMPTS):
        try:
            return _recorded(draw(rng), subject, source, rng)
        except (DrawnAgain, RuntimeError, RecordingError) as reason:
            why.append(str(reason))
    raise RuntimeError(f"{subject}: no usable recording in {MAX_ATTEMPTS} draws; the last: {why[-1]}")


def visit_name(stream: str, number: int, name: str) -> str:
    """Return what a recording is called: by stream, pair and visit."""
    return f"{stream} {number + 1:03d} {name}".replace(" ", "-")


def _heart_in(context: Context, source: PairSource, rng: np.random.Generator) -> VisitTruth:
    """Draw a heart of the generator in a context; late diastole is as stiff as designed."""
    hearts = source.hearts
    _check_context(context, source)
    volunteer = volunteer_in(context, hearts.physiology, hearts.prior, hearts.acquisition, rng)
    speed_scale = float(np.exp(hearts.acquisition.scale_fraction * rng.standard_normal()))
    beats = beats_of(volunteer, 1.0)
    active, shape = (
        beats.active_stiffness_kpa[0],
        passive_shape(beats.stretch[0], volunteer.passive_exponent_b),
    )
    scale = designed_scale(volunteer.late_diastolic_kpa, beats.cycle_phase, active, shape)
    if scale <= 0.0:
        raise DrawnAgain("active in late diastole beyond the designed stiffness")
    return VisitTruth(volunteer, 1.0, scale, speed_scale)


def later_truth(
    first: VisitTruth, variant: Variant, number: int, source: PairSource, rng: np.random.Generator
) -> VisitTruth:
    """Draw what is true at the second visit of a pair.

    The passive scale stays; where physiology is drawn anew in part it follows the designed stiffness.

    Raises:
        DrawnAgain: Theta leaves the prior's bounds, or the heart rate those of the population.
    """
    own, spreads, apart = first.volunteer, source.spreads, np.sqrt(2.0)
    theta = np.array(own.theta) * variant.theta_factors(number, rng)
    if not in_bounds(theta[None], source.hearts.prior)[0]:
        raise DrawnAgain(f"theta {theta} outside the prior's bounds")
    rate, resistance, capacitance, volume = np.exp(
        apart
        * rng.standard_normal(4)
        * (spreads.heart_rate, spreads.loading, spreads.loading, spreads.stressed_volume)
    )
    context = replace(own.context, hr_bpm=own.context.hr_bpm * float(rate))
    _check_context(context, source)
    kept = physiology_anew(own, source.hearts.physiology, variant.kept, rng)
    of_day = {
        RESISTANCE: getattr(own, RESISTANCE) * float(resistance),
        CAPACITANCE: getattr(own, CAPACITANCE) * float(capacitance),
        ALPHA: kept[ALPHA] * variant.alpha_factor,
    }
    return VisitTruth(
        volunteer=replace(own, context=context, theta=tuple(theta.tolist()), **kept | of_day),
        stressed_volume_factor=first.stressed_volume_factor * float(volume),
        passive_scale_kpa=first.passive_scale_kpa * kept[LATE_DIASTOLIC] / own.late_diastolic_kpa,
        speed_scale=_scale_anew(
            first.speed_scale, source.hearts.acquisition.scale_fraction, variant.kept, rng
        ),
    )


def physiology_anew(
    own: Volunteer, ranges: Mapping[str, Range], kept: float, rng: np.random.Generator
) -> dict[str, float]:
    """Return the physiology of the second visit but for the day's loading, by name.

    The normal scores of each quantity, which is uniform in its range, have the correlation ``kept``; at 1
    every value stays, to the bit.
    """
    anew = {}
    for name, (low, high) in ranges.items():
        value, fresh = float(getattr(own, name)), rng.standard_normal()
        if name in (RESISTANCE, CAPACITANCE):
            continue
        if kept < 1.0:
            score = kept * ndtri((value - low) / (high - low)) + np.sqrt(1.0 - kept**2) * fresh
            value = float(low + (high - low) * ndtr(score))
        anew[name] = value
    return anew


def _scale_anew(own: float, sd: float, kept: float, rng: np.random.Generator) -> float:
    fresh = sd * rng.standard_normal()
    return own if kept == 1.0 else float(np.exp(kept * np.log(own) + np.sqrt(1.0 - kept**2) * fresh))


def _check_context(context: Context, source: PairSource) -> None:
    if outside := in_declared_range(context, source.population):
        raise DrawnAgain("; ".join(outside))
    if not is_plausible(context):
        raise DrawnAgain("a context that ingestion refuses")


def beats_of(volunteer: Volunteer, stressed_volume_factor: float) -> Beats:
    """Simulate a volunteer's beat with so many times the stressed volume.

    Raises:
        DrawnAgain: It is not periodic.
    """
    settings = forward_model_of(volunteer)
    filled = replace(
        Physiology.of_settings(settings, 1), **{VOLUME_FACTOR: np.array([stressed_volume_factor])}
    )
    beats = simulate(np.array([volunteer.theta]), volunteer.context, settings, filled)
    if beats.status[0] != Status.PERIODIC:
        raise DrawnAgain(Status(beats.status[0]).name)
    return beats


def shown_curve(truth: VisitTruth, beats: Beats) -> TruthCurve:
    """Return the stiffness that speeds show: their scale enters as its square."""
    passive = truth.passive_scale_kpa * passive_shape(beats.stretch[0], truth.volunteer.passive_exponent_b)
    return TruthCurve(beats.cycle_phase, truth.speed_scale**2 * (passive + beats.active_stiffness_kpa[0]))


def _recorded(truth: VisitTruth, subject: str, source: PairSource, rng: np.random.Generator) -> RecordedVisit:
    beats = beats_of(truth.volunteer, truth.stressed_volume_factor)
    ratio = float(beats.end_systolic_volume_ml[0] / beats.end_diastolic_volume_ml[0])
    named = replace(truth.volunteer.context, subject=subject)
    listed = with_own_lvesv(named, ratio, source.hearts.lvesv_fraction, rng)
    # the scale of the speeds is the person's here, and so drawn with them
    protocol = source.hearts.acquisition.model_copy(update={"scale_fraction": 0.0})
    samples = acquire(shown_curve(truth, beats), listed, protocol, rng)
    observation = ingest(samples, listed, source.recording, source.grid_points)
    return RecordedVisit(truth, float(beats.active_stiffness_kpa[0].max()), samples, observation)


def shared_truth(truth: VisitTruth, model: ForwardModelSettings) -> dict[str, float]:
    """Return the true values of what a person keeps, by the inference model's names.

    Args:
        truth: Of a visit, whose beat tells the passive stiffness at its ends and between.
        model: The inference model, of whose wall the person's is a multiple.

    Raises:
        DrawnAgain: The visit's beat is not periodic.
    """
    own = forward_model_of(truth.volunteer)
    stretch = beats_of(truth.volunteer, truth.stressed_volume_factor).stretch[0]
    longest, shortest = stretch.max(), stretch.min()
    at = np.array([longest, 0.5 * (longest + shortest), shortest])
    first, middle, last = passive_shape(at, truth.volunteer.passive_exponent_b)
    return {
        "activation_ramp_s": own.activation_ramp_s,
        "destruction_alpha": own.destruction_alpha,
        "sigma_0_pa": own.sigma_0_pa,
        "passive_wall_factor": own.passive_c0_pa / model.passive_c0_pa,
        "length_dependence": own.length_dependence,
        "passive_ratio": float(last / first),
        "passive_middle_factor": float(middle / np.sqrt(first * last)),
        "speed_scale": truth.speed_scale,
    }
