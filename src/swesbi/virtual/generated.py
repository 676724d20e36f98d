"""A generated cohort with known model error: contexts, theta and physiology drawn at random, then recorded.

Its mechanics are as rich as the virtual volunteers' (valve and wall inertia, a slower ramp of activation),
and what differs between hearts is drawn from ranges that span G and H.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.measurement.speeds import SpeedRecording, measured_speeds
from swesbi.prior import PriorSettings, sample
from swesbi.recording.acquisition import acquire
from swesbi.recording.ingest import ingest
from swesbi.recording.noise.cohort import fit_noise
from swesbi.recording.noise.sweeps import levels_by
from swesbi.recording.observation import Observation
from swesbi.recording.problems import RecordingError
from swesbi.recording.quality import rejection
from swesbi.recording.samples import ACCEPTED, Samples
from swesbi.recording.settings import AcquisitionSettings, RecordingSettings, Repeats
from swesbi.seeds import generator
from swesbi.virtual.volunteers import Volunteer, simulate_truth

LOGGER = logging.getLogger("swesbi")
Range = tuple[float, float]
AGE_YEARS: Final[Range] = (19.0, 30.0)
HR_BPM: Final[Range] = (55.0, 85.0)
VOLUME_RATIO: Final[Range] = (0.35, 0.40)  # LVESV over LVEDV
BY_SEX: Final[dict[str, dict[str, Range]]] = {
    "F": {"bsa_m2": (1.50, 1.75), "lvedv_ml": (68.0, 100.0), "ivsd_cm": (0.62, 0.78)},
    "M": {"bsa_m2": (1.75, 2.00), "lvedv_ml": (95.0, 125.0), "ivsd_cm": (0.76, 0.94)},
}
PHYSIOLOGY: Final[dict[str, Range]] = {
    "late_diastolic_kpa": (3.6, 5.0),
    "passive_exponent_b": (2.0, 4.0),
    "sigma_0_kpa": (85.0, 95.0),
    "destruction_alpha": (1.2, 2.0),
    "wall_stiffness": (2.6, 3.5),
    "distal_resistance_pa_s_m3": (1.4e8, 1.6e8),
    "systemic_capacitance_m3_pa": (0.9e-8, 1.1e-8),
    "activation_onset_s": (0.037, 0.045),
    "activation_duration_s": (0.315, 0.330),
}
MAX_ATTEMPTS: Final = 20


@dataclass(frozen=True)
class GeneratedSubject:
    """A recording as inference sees it, with the errors of the generated cohort, and true theta (d,)."""

    recording: SpeedRecording
    theta: FloatArray


@dataclass(frozen=True)
class GeneratedRecording:
    """One generated subject before the cohort's noise is known: truth, samples, observed curve."""

    volunteer: Volunteer
    samples: Samples
    observation: Observation


def generate_cohort(
    count: int,
    prior: PriorSettings,
    acquisition: AcquisitionSettings,
    recording: RecordingSettings,
    grid_points: int,
    seed: int,
) -> tuple[GeneratedSubject, ...]:
    """Generate subjects and record each sample by sample; the noise is estimated from their repeats.

    Each subject has a stream of its own, so a larger cohort begins with the smaller one. What the heart does
    not simulate or ingestion refuses is drawn again, up to ``MAX_ATTEMPTS`` times.
    """
    recorded = [
        record_subject(index, prior, acquisition, recording, grid_points, seed) for index in range(count)
    ]
    repeats: Repeats = "sweeps" if acquisition.sweep_fraction > 0.0 else "separate"
    levels = {
        one.observation.subject: levels_by(
            repeats, one.samples, rejection(one.samples, recording) == ACCEPTED
        )
        for one in recorded
    }
    noise = fit_noise(levels).pooled.components
    return tuple(
        GeneratedSubject(measured_speeds(subject.observation, noise), np.array(subject.volunteer.theta))
        for subject in recorded
    )


def draw_volunteer(
    index: int, prior: PriorSettings, acquisition: AcquisitionSettings, rng: np.random.Generator
) -> Volunteer:
    """Draw the context, theta and physiology of one subject."""
    return volunteer_in(draw_context(index, rng), PHYSIOLOGY, prior, acquisition, rng)


def draw_context(index: int, rng: np.random.Generator) -> Context:
    """Draw the context of the subject of this number; the sexes alternate."""
    sex: Literal["F", "M"] = "M" if index % 2 else "F"
    body = {name: float(rng.uniform(*limits)) for name, limits in BY_SEX[sex].items()}
    return Context(
        subject=f"G{index + 1:02d}",
        sex=sex,
        age_years=float(rng.uniform(*AGE_YEARS)),
        hr_bpm=float(rng.uniform(*HR_BPM)),
        lvesv_ml=body["lvedv_ml"] * float(rng.uniform(*VOLUME_RATIO)),
        **body,
    )


def volunteer_in(
    context: Context,
    ranges: Mapping[str, Range],
    prior: PriorSettings,
    acquisition: AcquisitionSettings,
    rng: np.random.Generator,
) -> Volunteer:
    """Draw theta from the prior, and each physiological quantity uniformly from its range, in a context."""
    theta = tuple(sample(1, prior, rng)[0].tolist())
    physiology = {name: float(rng.uniform(*limits)) for name, limits in ranges.items()}
    return Volunteer(
        context, theta, acquisition=acquisition, design="drawn at random", model_version=3, **physiology
    )


def record_subject(
    index: int,
    prior: PriorSettings,
    acquisition: AcquisitionSettings,
    recording: RecordingSettings,
    grid_points: int,
    seed: int,
) -> GeneratedRecording:
    """Generate and record the subject of this number; see :func:`generate_cohort`."""
    for attempt in range(MAX_ATTEMPTS):
        rng = generator(seed, "discrepancy", "subject", index, attempt)
        volunteer = draw_volunteer(index, prior, acquisition, rng)
        try:
            truth = simulate_truth(volunteer)
            samples = acquire(truth.curve, volunteer.context, acquisition, rng)
            observation = ingest(samples, volunteer.context, recording, grid_points)
        except (RuntimeError, RecordingError) as error:
            LOGGER.info("generated subject %s drawn again: %s", volunteer.context.subject, error)
        else:
            return GeneratedRecording(volunteer, samples, observation)
    raise RuntimeError(f"generated subject {index}: no usable recording in {MAX_ATTEMPTS} attempts")
