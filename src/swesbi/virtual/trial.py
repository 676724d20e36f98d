"""A virtual trial: two groups of persons, each recorded twice, one group treated in between.

``python data/virtual_trial/make.py`` writes the shipped one anew. Every number of its design was chosen
before any recording of the trial had been answered. They stand here and not in the study's configuration
since no result of the study depends on them.

Its mechanics are those of the virtual volunteers, richer than the inference model's: valve inertance, wall
inertia, fine steps. What is not known of a heart is drawn from the prior of the study.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np
from pydantic import Field

from swesbi.base.arrays import FloatArray
from swesbi.base.settings import Settings
from swesbi.context import Context
from swesbi.heart.periodic import Status
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import Beats, simulate
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.measurement.operator import active_stiffness_map
from swesbi.measurement.speeds import shortening
from swesbi.parameters import OF_THETA, PASSIVE, THETA_NAMES, ParameterPrior
from swesbi.population.contexts import draw_one, is_plausible
from swesbi.population.settings import PopulationSettings, in_declared_range
from swesbi.prior import JointPriorSettings, in_bounds, sample
from swesbi.recording.acquisition import TruthCurve, acquire
from swesbi.recording.ingest import ingest
from swesbi.recording.problems import RecordingError
from swesbi.recording.samples import Samples
from swesbi.recording.settings import ACQUISITION, AcquisitionSettings, RecordingSettings
from swesbi.seeds import generator
from swesbi.virtual.volunteers import COMMON, with_own_lvesv

Spread = Annotated[float, Field(ge=0, lt=0.5)]
STREAM: Final = "virtual trial"
"""Name of the trial's streams under the study's seed."""
CONTROL, TREATED = "control", "treated"
BEFORE, AFTER = "before", "after"
POPULATION: Final = "amortised"
"""The experiment over a population whose persons take part."""
GROUPS: Final = (CONTROL, TREATED)
VISITS: Final = (BEFORE, AFTER)
LOADING: Final = ("distal_resistance_pa_s_m3", "arterial_time_constant_s")
"""What of a person's physiology is of the day, beside the heart rate."""
SPEED_SCALE: Final = "speed_scale"
AT_SCALE_ONE: Final = ACQUISITION.model_copy(update={"scale_fraction": 0.0})
"""That of the virtual volunteers; the scale of the speeds is a person's in part, and so drawn with them."""
MECHANICS: Final = ForwardModelSettings.from_plain(dict(COMMON))
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


class TrialSettings(Settings):
    """Who takes part, and what changes; spreads are standard deviations of logarithms."""

    persons_per_group: int = Field(ge=1, description="persons of each group")
    population_group: str = Field(description="group of the study's population whose persons they are")
    prior_share: float = Field(
        gt=0,
        le=1,
        description="spread of theta and of the passive stiffness between persons, over that of the prior",
    )
    theta_spread: Spread = Field(description="of each of theta from visit to visit of a person")
    passive_spread: Spread = Field(description="of the passive stiffness from visit to visit")
    loading_spread: Spread = Field(description="of R_d, and of the time constant, from visit to visit")
    heart_rate_spread: Spread = Field(description="of the heart rate from visit to visit")
    kept_scale_share: float = Field(
        ge=0, le=1, description="share of the variance of the log scale of speeds that a person keeps"
    )
    weeks_between: float = Field(gt=0, description="between the visits")
    effect: dict[str, float] = Field(description="factor on parameters of the treated at the second visit")
    ejection_fraction: tuple[float, float] = Field(
        description="of the beat at the first visit, of a person who takes part"
    )


TRIAL: Final = TrialSettings(
    persons_per_group=12,
    population_group="adults",
    prior_share=0.5,
    theta_spread=0.05,
    passive_spread=0.05,
    loading_spread=0.08,
    heart_rate_spread=0.06,
    kept_scale_share=0.5,
    weeks_between=12.0,
    effect={"k0_kpa": 1.1, "k_sr_per_s": 0.75},
    ejection_fraction=(0.5, 0.75),
)
"""The shipped design; all of it is chosen, but for the ejection fraction of health (Lang et al., J Am Soc
Echocardiogr 28:1, 2015)."""


@dataclass(frozen=True)
class TrialSource:
    """What of the study's configuration the trial is drawn with.

    Contexts are of one group of the population. ``model`` has the prior of phi between persons, ``bounds``
    that of the study, whose bounds no visit leaves; ``lvesv_fraction`` is the sd of the logarithm of a
    measured LVESV.
    """

    trial: TrialSettings
    population: PopulationSettings
    model: SpeedModelSettings
    bounds: JointPriorSettings
    acquisition: AcquisitionSettings
    recording: RecordingSettings
    grid_points: int
    lvesv_fraction: float
    seed: int


def narrowed(prior: JointPriorSettings, share: float) -> JointPriorSettings:
    """Return the prior with a share of its spread of theta and passive stiffness; the rest as it is."""

    def narrow(parameter: ParameterPrior) -> ParameterPrior:
        return parameter.model_copy(update={"log_sd": share * parameter.log_sd})

    theta = {name: narrow(getattr(prior.theta, name)) for name in THETA_NAMES}
    return JointPriorSettings(
        theta=prior.theta.model_copy(update=theta), passive_stiffness_kpa=narrow(prior.passive_stiffness_kpa)
    )


def noisier(acquisition: AcquisitionSettings, factor: float) -> AcquisitionSettings:
    """Return the acquisition with so many times the errors of samples, repeats and sweeps."""
    names = ("sample_sd_fraction", "repeat_sd_fraction", "sweep_fraction")
    return acquisition.model_copy(update={name: factor * getattr(acquisition, name) for name in names})


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
