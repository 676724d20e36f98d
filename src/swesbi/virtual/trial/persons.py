"""The persons of the virtual trial: drawn one by one, simulated at both visits, and recorded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.heart.periodic import Status
from swesbi.heart.simulate import Beats, simulate
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.measurement.operator import active_stiffness_map
from swesbi.measurement.speeds import shortening
from swesbi.parameters import OF_THETA, PASSIVE, THETA_NAMES
from swesbi.population.contexts import draw_one, is_plausible
from swesbi.population.settings import in_declared_range
from swesbi.prior import JointPriorSettings, in_bounds, sample
from swesbi.recording.acquisition import TruthCurve, acquire
from swesbi.recording.ingest import ingest
from swesbi.recording.problems import RecordingError
from swesbi.recording.samples import Samples
from swesbi.seeds import generator
from swesbi.virtual.trial.settings import (
    AFTER,
    GROUPS,
    LOADING,
    SPEED_SCALE,
    STREAM,
    TREATED,
    VISITS,
    TrialSource,
)
from swesbi.virtual.volunteers import with_own_lvesv

MAX_ATTEMPTS: Final = 100
WEEKS_PER_YEAR: Final = 365.25 / 7.0
CONTEXT, BOUNDS, PERIODIC, EJECTION, VOLUME, RECORDING = (
    "a heart rate outside the declared range",
    "a parameter outside the prior's bounds",
    "no periodic beat",
    "ejection fraction of the first visit",
    "no volume that ingestion admits",
    "a recording that ingestion refuses",
)
"""Why a person is drawn again."""


class DrawnAgain(Exception):
    """A person who does not take part; the message is one of the reasons above."""


@dataclass(frozen=True)
class TrialVisit:
    """One recording with all that is true of it; the context is as a clinic lists it at the visit.

    ``phi`` are true parameters by name: theta, passive stiffness, nuisances. Peak active stiffness and
    ejection fraction are those of the true beat.
    """

    context: Context
    visit: str
    phi: Mapping[str, float]
    peak_active_kpa: float
    ejection_fraction: float
    samples: Samples


@dataclass(frozen=True)
class TrialPerson:
    """A person with both visits, and why those drawn before in their place did not take part."""

    name: str
    group: str
    visits: tuple[TrialVisit, ...]
    drawn_again: tuple[str, ...]


def draw_trial(source: TrialSource) -> tuple[TrialPerson, ...]:
    """Draw all persons; which group each is in is drawn first, so that both are of one size."""
    each = source.trial.persons_per_group
    shuffled = generator(source.seed, STREAM, "groups").permutation(np.repeat(GROUPS, each))
    return tuple(draw_person(number, str(group), source) for number, group in enumerate(shuffled))


def draw_person(number: int, group: str, source: TrialSource) -> TrialPerson:
    """Draw the person of this number, whatever the others; who does not take part is drawn again.

    A RuntimeError says that nobody took part in many draws.
    """
    name, reasons = f"P{number + 1:02d}", []
    for attempt in range(MAX_ATTEMPTS):
        rng = generator(source.seed, STREAM, "person", number, attempt)
        try:
            visits = _draw_visits(name, number, group, source, rng)
        except DrawnAgain as reason:
            reasons.append(str(reason))
        else:
            return TrialPerson(name, group, visits, tuple(reasons))
    raise RuntimeError(f"{name}: nobody took part in {MAX_ATTEMPTS} draws: {sorted(set(reasons))}")


def _draw_visits(
    name: str, number: int, group: str, source: TrialSource, rng: np.random.Generator
) -> tuple[TrialVisit, ...]:
    context = draw_one(number, source.population, rng).context
    own = dict(zip(source.model.prior.names, sample(1, source.model.prior, rng)[0].tolist(), strict=True))
    visits = []
    for visit in VISITS:
        of_day = replace(at_visit(context, visit, source, rng), subject=f"{name}-{visit}")
        phi = phi_at_visit(own, visit, group, source, rng)
        visits.append(record_visit(of_day, visit, phi, source, rng))
    return tuple(visits)


def at_visit(context: Context, visit: str, source: TrialSource, rng: np.random.Generator) -> Context:
    """Return what a clinic lists at a visit, rounded as it would be: age and heart rate are of the day."""
    weeks = source.trial.weeks_between if visit == AFTER else 0.0
    hr_bpm = context.hr_bpm * np.exp(source.trial.heart_rate_spread * rng.standard_normal())
    listed = Context(
        subject=context.subject,
        sex=context.sex,
        age_years=round(round(context.age_years, 1) + weeks / WEEKS_PER_YEAR, 1),
        bsa_m2=round(context.bsa_m2, 2),
        hr_bpm=float(round(hr_bpm)),
        lvedv_ml=float(round(context.lvedv_ml)),
        lvesv_ml=context.lvesv_ml,
        ivsd_cm=round(context.ivsd_cm, 2),
    )
    if in_declared_range(listed, source.population) or not is_plausible(listed):
        raise DrawnAgain(CONTEXT)
    return listed


def phi_at_visit(
    own: Mapping[str, float], visit: str, group: str, source: TrialSource, rng: np.random.Generator
) -> dict[str, float]:
    """Return the true parameters of a visit: the person's, those of the day, and what the drug does.

    ``own`` are the person's by name; of the scale of the speeds a share is kept.
    """
    trial, phi = source.trial, dict(own)
    spreads = dict.fromkeys(THETA_NAMES, trial.theta_spread)
    spreads |= {PASSIVE.name: trial.passive_spread} | dict.fromkeys(LOADING, trial.loading_spread)
    for name, spread in spreads.items():
        phi[name] *= float(np.exp(spread * rng.standard_normal()))
    phi[SPEED_SCALE] = scale_of_day(own[SPEED_SCALE], source, rng)
    if (group, visit) == (TREATED, AFTER):
        phi |= {name: factor * phi[name] for name, factor in trial.effect.items()}
    check_bounds(phi, source.bounds)
    return phi


def check_bounds(phi: Mapping[str, float], prior: JointPriorSettings) -> None:
    """Draw the person again whose parameters leave the bounds of a prior."""
    if not in_bounds(_row(phi, prior), prior)[0]:
        raise DrawnAgain(BOUNDS)


def scale_of_day(own: float, source: TrialSource, rng: np.random.Generator) -> float:
    """Return the scale of a visit's speeds: of the variance of its logarithm the person keeps a share."""
    prior, kept = (
        source.bounds.theta.nuisances.freed([SPEED_SCALE])[SPEED_SCALE],
        source.trial.kept_scale_share,
    )
    of_day = prior.log_sd * rng.standard_normal()
    return float(
        prior.centre * np.exp(np.sqrt(kept) * np.log(own / prior.centre) + np.sqrt(1.0 - kept) * of_day)
    )


def _row(phi: Mapping[str, float], prior: JointPriorSettings) -> FloatArray:
    return np.array([[phi[name] for name in prior.names]])


def record_visit(
    context: Context, visit: str, phi: Mapping[str, float], source: TrialSource, rng: np.random.Generator
) -> TrialVisit:
    """Record a simulated visit; without a healthy beat or a usable recording the person is drawn again."""
    beats, curve = true_curve(context, phi, source.model)
    fraction = float(beats.ejection_fraction[0])
    low, high = source.trial.ejection_fraction
    if visit == VISITS[0] and not low <= fraction <= high:
        raise DrawnAgain(EJECTION)
    try:
        measured = with_own_lvesv(context, 1.0 - fraction, source.lvesv_fraction, rng)
    except RuntimeError as error:
        raise DrawnAgain(VOLUME) from error
    listed = replace(measured, lvesv_ml=float(round(measured.lvesv_ml)))
    samples = acquire(curve, listed, source.acquisition, rng)
    try:
        ingest(samples, listed, source.recording, source.grid_points)
    except RecordingError as error:
        raise DrawnAgain(RECORDING) from error
    return TrialVisit(listed, visit, phi, float(beats.active_stiffness_kpa[0].max()), fraction, samples)


def true_curve(
    context: Context, phi: Mapping[str, float], model: SpeedModelSettings
) -> tuple[Beats, TruthCurve]:
    """Return the true beat, and the stiffness that its speeds show: their scale enters as its square."""
    row = _row(phi, model.prior)
    beats = simulate(row[:, OF_THETA], context, model.forward_model, model.physiology(row))
    if beats.status[0] != Status.PERIODIC:
        raise DrawnAgain(PERIODIC)
    by = model.measured_by(row)
    active = active_stiffness_map(model.measurement.active_stiffness_map)(beats.active_stiffness_kpa)
    shown = np.square(by.speed_scale) * (by.passive_kpa(shortening(beats.stretch)) + active)[0]
    return beats, TruthCurve(beats.cycle_phase, shown)
