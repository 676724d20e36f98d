"""The virtual volunteers: contexts, true theta, the physiology in which each differs, true curves.

Their mechanics are richer than the inference model's: valve inertance, wall inertia, and a circulation, wall,
activation and passive exponent of their own. A to F stand for the paper's cases, and are designed from the
numbers that it prints; ``data/virtual_volunteers/README.md`` has each choice with its number.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Final, Literal, get_type_hints

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.heart.periodic import Status
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import Beats, simulate
from swesbi.measurement.derived import LATE_DIASTOLE
from swesbi.measurement.operator import passive_shape
from swesbi.population.contexts import is_plausible
from swesbi.recording.acquisition import TruthCurve, acquire
from swesbi.recording.samples import Samples
from swesbi.recording.settings import ACQUISITION, AcquisitionSettings, EctopicBeat
from swesbi.seeds import generator

PASSIVE_C0_PA: Final = 444.0  # C_0 and C_2 of the PhysioBlocks 2.0.1 human heart, of which a volunteer
PASSIVE_C2_PA: Final = 69.0  # has a multiple
ACTIVATION_RAMP_S: Final = 0.03
COMMON: Final[Mapping[str, str | bool | float]] = {
    "geometry": "midwall",
    "passive_law": "exponential",
    "active_law": "bcs",
    "stress_measure": "first_piola",
    "length_dependence": 0.0,
    "valves": "inertance",
    "wall_inertia": True,
    "circulation": "closed",
    "passive_c0_pa": 3.0 * PASSIVE_C0_PA,
    "passive_c1": 2.9,
    "passive_c2_pa": 3.0 * PASSIVE_C2_PA,
    "passive_c3": 6.5,
    "wall_viscosity_pa_s": 70.0,
    "fibre_viscosity_pa_s": 70.0,
    "sigma_0_pa": 90e3,
    "destruction_alpha": 1.5,
    "wall_density_kg_m3": 1000.0,
    "activation_onset_s": 0.04,
    "activation_duration_s": 0.32,
    "activation_reference_period_s": 0.8,
    "activation_ramp_s": ACTIVATION_RAMP_S,
    "mitral_resistance_pa_s_m3": 1.11e5,
    "aortic_resistance_pa_s_m3": 7.69e4,
    "mitral_inertance_pa_s2_m3": 1e3,
    "aortic_inertance_pa_s2_m3": 3e4,
    "proximal_resistance_pa_s_m3": 7e6,
    "distal_resistance_pa_s_m3": 1.5e8,
    "systemic_capacitance_m3_pa": 1.0e-8,
    "pulmonary_resistance_pa_s_m3": 1e7,
    "pulmonary_capacitance_m3_pa": 1.2e-7,
    "initial_displacement_ratio": 0.05,
    "initial_arterial_pressure_pa": 11e3,
    "initial_pulmonary_pressure_pa": 1.1e3,
    "steps_per_beat": 2000,
    "samples_per_beat": 400,
    "periodicity_tolerance": 1e-5,
    "maximum_beats": 100,
    "extrapolation_memory": 0,
    "maximum_step_s": 1e-3,
}
"""What all hearts of this kind share, as in model version 3; it does not change with the configuration."""
VERSION_4: Final[Mapping[str, float]] = {
    "mitral_resistance_pa_s_m3": 4e5,
    "proximal_resistance_pa_s_m3": 5e6,
    "pulmonary_capacitance_m3_pa": 7e-8,
    "initial_pulmonary_pressure_pa": 1050.0,
}
"""What model version 4 has otherwise; A to F have it."""
MAX_ATTEMPTS: Final = 100
_PREMATURE = EctopicBeat(phase_index=6, repeat=1, rr_ratio=0.64)


@dataclass(frozen=True)
class ReadmeColumn:
    """How the cohort's README shows a parameter: heading, format, and the value of one unit."""

    head: str
    spec: str = "g"
    one: float = 1.0

    def text(self, value: float) -> str:
        """Return a value in the heading's unit."""
        return f"{value / self.one:{self.spec}}"


@dataclass(frozen=True)
class Volunteer:
    """One virtual volunteer: the measured context, and the truth that inference does not see.

    Theta is in the order of ``THETA_NAMES``. The mean stiffness in late diastole is designed, and sets the
    passive scale; sigma_0 is the active stress of the fully activated fibre, alpha the bonds destroyed per
    unit of strain, ``wall_stiffness`` a multiple of C_0 and C_2. Activation begins after the R peak by its
    onset, lasts its duration at a period of 0.8 s, and takes its ramp to rise and to fall. ``model_version``
    is of the model whose constants the circulation has.
    """

    context: Context
    theta: tuple[float, ...]
    passive_exponent_b: Annotated[float, ReadmeColumn("b")]
    late_diastolic_kpa: float
    sigma_0_kpa: Annotated[float, ReadmeColumn("sigma_0 (kPa)")]
    destruction_alpha: Annotated[float, ReadmeColumn("alpha")]
    wall_stiffness: Annotated[float, ReadmeColumn("wall")]
    distal_resistance_pa_s_m3: Annotated[float, ReadmeColumn("R_d (1e8 Pa s/m3)", ".2f", 1e8)]
    systemic_capacitance_m3_pa: Annotated[float, ReadmeColumn("C_s (1e-8 m3/Pa)", ".2f", 1e-8)]
    activation_onset_s: Annotated[float, ReadmeColumn("onset (ms)", "g", 1e-3)]
    activation_duration_s: Annotated[float, ReadmeColumn("duration (ms)", "g", 1e-3)]
    acquisition: AcquisitionSettings
    design: str
    activation_ramp_s: Annotated[float, ReadmeColumn("ramp (ms)", "g", 1e-3)] = ACTIVATION_RAMP_S
    model_version: Literal[3, 4] = 3


OWN_PARAMETERS: Final = tuple(name for name, kind in get_type_hints(Volunteer).items() if kind is float)
"""The physiology in which volunteers differ, in the order of the columns of ``truth.csv``."""
SHOWN: Final[Mapping[str, ReadmeColumn]] = {
    name: mark
    for name, kind in get_type_hints(Volunteer, include_extras=True).items()
    for mark in getattr(kind, "__metadata__", ())
}
"""Columns of the README's table of truths, behind theta and the passive stiffness."""


def forward_model_of(volunteer: Volunteer) -> ForwardModelSettings:
    """Return the forward-model settings of one volunteer."""
    physiology = {
        "sigma_0_pa": 1e3 * volunteer.sigma_0_kpa,
        "destruction_alpha": volunteer.destruction_alpha,
        "passive_c0_pa": PASSIVE_C0_PA * volunteer.wall_stiffness,
        "passive_c2_pa": PASSIVE_C2_PA * volunteer.wall_stiffness,
        "distal_resistance_pa_s_m3": volunteer.distal_resistance_pa_s_m3,
        "systemic_capacitance_m3_pa": volunteer.systemic_capacitance_m3_pa,
        "activation_onset_s": volunteer.activation_onset_s,
        "activation_duration_s": volunteer.activation_duration_s,
        "activation_ramp_s": volunteer.activation_ramp_s,
    }
    constants = VERSION_4 if volunteer.model_version == 4 else {}
    return ForwardModelSettings.from_plain({**COMMON, **constants, **physiology})


QUIET: Final[Mapping[str, float | int]] = {
    "samples_per_repeat": 24,
    "repeat_sd_fraction": 0.004,
    "sweep_fraction": 0.002,
    "scale_fraction": 0.0,
}
"""Errors of A to F over those of the common protocol: single speeds keep 6 %, and hardly anything repeats."""


def _acquisition(outliers: float) -> AcquisitionSettings:
    return ACQUISITION.model_copy(update={"outlier_fraction": outliers})


def _quiet(
    outliers: float, missing: tuple[int, ...] = (), ectopic: tuple[EctopicBeat, ...] = ()
) -> AcquisitionSettings:
    return _acquisition(outliers).model_copy(
        update={**QUIET, "missing_phases": missing, "ectopic_beats": ectopic}
    )


VOLUNTEERS: Final = (
    Volunteer(
        Context("A", "M", 24.0, 1.88, 57.0, 118.0, 40.0, 0.88), (60.0, 4.8, 28.0),
        3.0, 4.5, 83.5, 1.37, 3.0, 1.35e8, 1.15e-8, 0.0374, 0.3174,
        _quiet(0.03), "the smallest range, nearest to the prior", 0.033, 4,
    ),
    Volunteer(
        Context("B", "F", 27.0, 1.68, 64.0, 84.0, 29.0, 0.74), (90.0, 5.0, 30.0),
        3.64, 4.8, 90.0, 1.66, 2.68, 1.55e8, 0.95e-8, 0.040, 0.320,
        _quiet(0.02, missing=(13,)), "model error over the whole beat", 0.036, 4,
    ),
    Volunteer(
        Context("C", "M", 21.0, 1.94, 69.0, 112.0, 36.0, 0.90), (86.0, 6.0, 25.0),
        2.7, 4.3, 87.6, 1.38, 3.12, 1.2e8, 1.3e-8, 0.0382, 0.317,
        _quiet(0.03, ectopic=(_PREMATURE,)), "nearest to the model", 0.026, 4,
    ),
    Volunteer(
        Context("D", "F", 19.0, 1.62, 78.0, 78.0, 27.0, 0.70), (93.0, 5.5, 23.0),
        2.72, 4.1, 91.75, 1.605, 2.86, 1.5e8, 0.96e-8, 0.04175, 0.3235,
        _quiet(0.04), "late, long activation; the largest residual after the peak", 0.0235, 4,
    ),
    Volunteer(
        Context("E", "M", 22.0, 1.80, 72.0, 99.0, 30.0, 0.78), (36.0, 42.0, 30.0),
        3.0, 3.9, 72.0, 1.5, 3.0, 0.85e8, 2e-8, 0.039, 0.320,
        _quiet(0.02, missing=(4,)), "excluded by its draws: k_ATP above the bound, z in reach", 0.040, 4,
    ),
    Volunteer(
        Context("F", "F", 20.0, 1.55, 84.0, 68.0, 21.0, 0.64), (52.5, 60.0, 30.0),
        3.0, 3.8, 80.0, 1.5, 3.0, 1e8, 1.9e-8, 0.046, 0.290,
        _quiet(0.03), "excluded by its up-slope: k_ATP far above the bound", 0.030, 4,
    ),
    Volunteer(
        Context("G", "F", 25.0, 1.70, 61.0, 90.0, 34.0, 0.76), (68.0, 6.0, 15.0),
        2.6, 4.4, 88.0, 1.5, 3.1, 1.55e8, 1.00e-8, 0.039, 0.316,
        _acquisition(0.03), "as a laboratory has it; relaxation half as fast as the prior's centre",
    ),
    Volunteer(
        Context("H", "M", 23.0, 1.86, 66.0, 104.0, 38.0, 0.84), (75.0, 6.5, 48.0),
        3.2, 4.2, 90.0, 1.6, 2.9, 1.50e8, 1.00e-8, 0.043, 0.328,
        _acquisition(0.02), "as a laboratory has it; relaxation half as fast again as the prior's centre",
    ),
)  # fmt: skip
"""Of each three rows: context and theta; exponent b, late diastole, sigma_0, alpha, wall, R_d, C_s, onset and
duration of activation; recording and purpose, of A to F also ramp and version of the constants."""


@dataclass(frozen=True)
class Truth:
    """All that is true of one volunteer: the beat, the passive scale, the passive and the total curve."""

    volunteer: Volunteer
    beats: Beats
    passive_scale_kpa: float
    passive_kpa: FloatArray
    curve: TruthCurve

    @property
    def active_kpa(self) -> FloatArray:
        """The active stiffness k_c of the beat; shape (M,)."""
        return np.asarray(self.beats.active_stiffness_kpa[0])


def simulate_truth(volunteer: Volunteer) -> Truth:
    """Simulate a volunteer, and set the passive scale so that late diastole is as stiff as designed."""
    beats = simulate(np.array([volunteer.theta]), volunteer.context, forward_model_of(volunteer))
    if beats.status[0] != Status.PERIODIC:
        raise RuntimeError(f"volunteer {volunteer.context.subject}: {Status(beats.status[0]).name}")
    active = beats.active_stiffness_kpa[0]
    shape = passive_shape(beats.stretch[0], volunteer.passive_exponent_b)
    scale = designed_scale(volunteer.late_diastolic_kpa, beats.cycle_phase, active, shape)
    curve = TruthCurve(beats.cycle_phase, scale * shape + active)
    return Truth(volunteer, beats, scale, scale * shape, curve)


def designed_scale(
    late_diastolic_kpa: float, cycle_phase: FloatArray, active_kpa: FloatArray, shape: FloatArray
) -> float:
    """Return the passive scale in kPa with which mean stiffness in late diastole is as designed."""
    window = (cycle_phase >= LATE_DIASTOLE[0]) & (cycle_phase <= LATE_DIASTOLE[1])
    return float((late_diastolic_kpa - active_kpa[window].mean()) / shape[window].mean())


def record(truth: Truth, seed: int) -> Samples:
    """Record a volunteer with the acquisition noise of this seed; each volunteer has a stream of its own.

    The shipped recordings are those of ``ACQUISITION_SEED``.
    """
    volunteer = truth.volunteer
    stream = generator(seed, "acquisition", volunteer.context.subject)
    return acquire(truth.curve, volunteer.context, volunteer.acquisition, stream)


def with_own_lvesv(
    context: Context, volume_ratio: float, lvesv_fraction: float, rng: np.random.Generator
) -> Context:
    """Return the context with the LVESV that is measured of the heart's own beat.

    LVESV = LVEDV ESV / EDV exp(sd z), z standard normal: the listed LVEDV sets the geometry, so the beat's
    volumes are reported on its scale, and ``volume_ratio`` is ESV / EDV. An error by which ingestion would
    refuse the context is drawn again; a RuntimeError says that it refuses all.
    """
    own_ml = context.lvedv_ml * volume_ratio
    for _ in range(MAX_ATTEMPTS):
        error = float(np.exp(lvesv_fraction * rng.standard_normal()))
        measured = replace(context, lvesv_ml=own_ml * error)
        if is_plausible(measured):
            return measured
    raise RuntimeError(
        f"{context.subject}: no LVESV that ingestion admits in {MAX_ATTEMPTS} measurements of a heart that "
        f"ejects {1.0 - volume_ratio:.3f} of its blood"
    )
