"""The tables of the virtual cohort and its README, written from the same numbers as its files."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Final

import numpy as np
import pandas as pd

from swesbi.arrays import FloatArray
from swesbi.parameters import PASSIVE_SCALE, THETA, THETA_NAMES
from swesbi.recording.clinical import ClinicalMeasures
from swesbi.recording.columns import STATUS_OK
from swesbi.recording.phases import to_grid
from swesbi.recording.samples import Samples
from swesbi.virtual_cohort.clinical import CLINICAL_ERRORS, true_measures
from swesbi.virtual_cohort.noise_levels import COMPARED, PAPER_RMSE_KPA, SEEDS, interpolation_error_kpa
from swesbi.virtual_cohort.readme_text import LEVELS, OTHER_SEEDS, TEXT
from swesbi.virtual_cohort.settings import ACQUISITION
from swesbi.virtual_cohort.volunteers import LATE_DIASTOLE, OWN_PARAMETERS, SHOWN, Truth

FINE_GRID: Final = 2001


LATE_DIASTOLIC_SPEED_M_S: Final = (0.87, 1.51)


PEAK_SPEED_M_S: Final = (2.1, 5.5)


CLOSURE_SPEED_M_S: Final = (2.5, 4.5)


STIFFNESS_RATIO: Final = (5.0, 25.0)


EJECTION_MS: Final = (292.0, 23.0)
OF_THE_BEAT: Final = ("systolic_aortic_pressure_mmhg", "diastolic_aortic_pressure_mmhg", "ejection_ms")
"""What of the true beat ``truth.csv`` has beside the volumes, which lie in ``truth_curves.csv``."""


@dataclass(frozen=True)
class SpeedSummary:
    """What a recording says at a glance, from the medians of its successful samples.

    ``closure_m_s`` is the speed when forward flow through the aortic valve ends in the true beat.
    """

    late_diastolic_m_s: float
    peak_m_s: float
    closure_m_s: float
    stiffness_ratio: float


def phase_medians(samples: Samples) -> tuple[FloatArray, FloatArray]:
    """Return phase and median speed of every phase with successful samples, ascending; shape (p,) each."""
    table = pd.DataFrame(
        {"index": samples.phase_index, "phase": samples.beat_phase, "speed": samples.speed_m_s}
    ).dropna()
    medians = table.groupby("index").median().sort_values("phase")
    return medians["phase"].to_numpy(np.float64), medians["speed"].to_numpy(np.float64)


def summarise_speeds(samples: Samples, truth: Truth) -> SpeedSummary:
    """Summarise a recording by late-diastolic, peak and valve-closure speed, and the stiffness ratio."""
    phase, speed = phase_medians(samples)
    late = float(speed[(phase >= LATE_DIASTOLE[0]) & (phase <= LATE_DIASTOLE[1])].mean())
    curve = to_grid(phase, speed, FINE_GRID)
    closure = float(np.interp(valve_closure_phase(truth), np.linspace(0.0, 1.0, FINE_GRID), curve))
    peak = float(speed.max())
    return SpeedSummary(late, peak, closure, (peak / late) ** 2)


def valve_closure_phase(truth: Truth) -> float:
    """Return the phase at which forward flow through the aortic valve ends."""
    return float(truth.beats.cycle_phase[np.flatnonzero(truth.beats.aortic_flow_ml_s[0] > 0.0)[-1]])


def subject_table(truths: Sequence[Truth], measures: Sequence[ClinicalMeasures]) -> pd.DataFrame:
    """Return the rows of ``subjects.csv``: contexts, and what a clinic measured, in whole numbers."""
    rows = [
        asdict(truth.volunteer.context) | {name: int(value) for name, value in asdict(measured).items()}
        for truth, measured in zip(truths, measures, strict=True)
    ]
    return pd.DataFrame(rows).astype(object)


def truth_table(truths: Sequence[Truth]) -> pd.DataFrame:
    """Return one row a volunteer: theta, passive scale, the richer physiology, what the true beat does."""
    return pd.DataFrame([_truth_row(truth) for truth in truths])


def curve_table(truths: Sequence[Truth]) -> pd.DataFrame:
    """Return the noiseless curves: one row per volunteer and cycle point."""
    return pd.concat([_curve_rows(truth) for truth in truths], ignore_index=True)


def haemodynamics(truth: Truth) -> dict[str, float]:
    """Return what the true beat does: volumes, ejection fraction, pressures, length of ejection."""
    beats, true = truth.beats, true_measures(truth)
    return {
        "end_diastolic_volume_ml": float(beats.end_diastolic_volume_ml[0]),
        "end_systolic_volume_ml": float(beats.end_systolic_volume_ml[0]),
        "ejection_fraction": float(beats.ejection_fraction[0]),
        "peak_ventricular_pressure_mmhg": float(beats.ventricular_pressure_mmhg[0].max()),
        "systolic_aortic_pressure_mmhg": true.sbp_mmhg,
        "diastolic_aortic_pressure_mmhg": true.dbp_mmhg,
        "ejection_ms": true.lvet_ms,
    }


def _truth_row(truth: Truth) -> dict[str, str | float]:
    volunteer = truth.volunteer
    theta = dict(zip(THETA_NAMES, volunteer.theta, strict=True))
    physiology = {name: getattr(volunteer, name) for name in OWN_PARAMETERS}
    scale = round(truth.passive_scale_kpa, 4)
    beat = {name: round(haemodynamics(truth)[name], 1) for name in OF_THE_BEAT}
    return {"subject": volunteer.context.subject, **theta, PASSIVE_SCALE.name: scale, **physiology, **beat}


def _curve_rows(truth: Truth) -> pd.DataFrame:
    columns = {
        "cycle_phase": truth.curve.cycle_phase,
        "passive_kpa": truth.passive_kpa,
        "active_kpa": truth.active_kpa,
        "stiffness_kpa": truth.curve.stiffness_kpa,
        "stretch": truth.beats.stretch[0],
        "volume_ml": truth.beats.volume_ml[0],
    }
    return pd.DataFrame({"subject": truth.volunteer.context.subject, **columns})


def readme(
    truths: Sequence[Truth],
    recordings: Sequence[Samples],
    measures: Sequence[ClinicalMeasures],
    seed: int,
    seed_medians: pd.DataFrame | None,
    levels: pd.DataFrame | None,
) -> str:
    """Return the text of the README.

    Args:
        truths: The volunteers' true beats.
        recordings: Their recordings, in the same order.
        measures: What a clinic measured of them, likewise.
        seed: The acquisition seed.
        seed_medians: Results over acquisition seeds, as texts, shown as they are; None if there are none yet.
        levels: What noise of each level leaves, as texts; None if it is not measured yet.
    """
    designs = "\n".join(f"- {t.volunteer.context.subject}: {t.volunteer.design}" for t in truths)
    return TEXT.format(
        seed=seed,
        truth=markdown(_truth_rows(truths)),
        designs=designs,
        haemodynamics=markdown(_haemodynamic_rows(truths)),
        measures=markdown(_measured_rows(truths, measures)),
        **_clinical_errors(),
        ejection_mean=EJECTION_MS[0],
        ejection_sd=EJECTION_MS[1],
        samples=markdown(_sample_rows(truths, recordings)),
        speeds=markdown(_speed_rows(truths, recordings)),
        seeds="" if seed_medians is None else _seeds(seed_medians, seed),
        levels="" if levels is None else _levels(levels, truths),
        **_sizes(),
    )


def _sizes() -> dict[str, str]:
    """Return the errors of a speed in percent: each of them, of a single speed, and of a phase mean."""
    own, repeat = ACQUISITION.sample_sd_fraction, ACQUISITION.repeat_sd_fraction
    sweep, samples = ACQUISITION.sweep_fraction, ACQUISITION.samples_per_repeat
    mean = math.sqrt((own**2 / samples + repeat**2 + sweep**2) / ACQUISITION.repeats)
    single = math.hypot(own, repeat, sweep)
    shown = {"sample": own, "repeat": repeat, "sweep": sweep, "scale": ACQUISITION.scale_fraction}
    return {name: f"{100.0 * value:g} %" for name, value in shown.items()} | {
        "single": f"{100.0 * single:.1f} %",
        "phase_se": f"{100.0 * mean:.1f} %",
    }


def _levels(levels: pd.DataFrame, truths: Sequence[Truth]) -> str:
    """Return the section on the level of the noise; the level in use is in bold."""
    mean = float(np.mean(list(PAPER_RMSE_KPA.values())))
    compared = [truth.curve for truth in truths if truth.volunteer.context.subject in COMPARED]
    sizes = _sizes()
    return LEVELS.format(
        paper=", ".join(f"{value:.2f}" for value in PAPER_RMSE_KPA.values()),
        mean=mean,
        low=0.7 * mean,
        high=0.9 * mean,
        table=markdown(pd.DataFrame([_level_row(row) for _, row in levels.iterrows()])),
        seeds=len(SEEDS),
        first=SEEDS[0],
        last=SEEDS[-1],
        interpolation=float(np.mean([interpolation_error_kpa(curve) for curve in compared])),
        scale=sizes["scale"],
        single=sizes["single"],
    )


def _level_row(row: pd.Series[str]) -> dict[str, str]:
    fractions = ("sample_sd_fraction", "repeat_sd_fraction", "sweep_fraction")
    heads = ("sample", "repeat", "sweep")
    shown = {head: f"{100.0 * float(row[name]):g} %" for head, name in zip(heads, fractions, strict=True)}
    shown |= {name: f"{float(row[f'rmse_{name}_kpa']):.2f}" for name in COMPARED}
    shown |= {"mean": f"{float(row['rmse_kpa']):.2f}"}
    shown |= {"as recorded": f"{float(row['rmse_as_recorded_kpa']):.2f}"}
    in_use = float(row["sample_sd_fraction"]) == ACQUISITION.sample_sd_fraction
    return {head: f"**{value}**" if in_use else value for head, value in shown.items()}


def _seeds(medians: pd.DataFrame, seed: int) -> str:
    """Return the section on other acquisition seeds."""
    counts = zip(medians["subject"], medians["seeds_supported"], strict=True)
    return OTHER_SEEDS.format(
        seeds=medians["seeds"].iloc[0],
        supported=", ".join(f"{count} of {subject}" for subject, count in counts),
        seed=seed,
        table=markdown(medians),
    )


def markdown(table: pd.DataFrame) -> str:
    """Return a table of texts as Markdown."""
    head = [" | ".join(map(str, table.columns)), "|".join(["---"] * len(table.columns))]
    rows = [" | ".join(map(str, row)) for row in table.itertuples(index=False)]
    return "\n".join(f"| {line} |" if "---" not in line else f"|{line}|" for line in (*head, *rows))


def _truth_rows(truths: Sequence[Truth]) -> pd.DataFrame:
    rows = []
    for truth in truths:
        volunteer = truth.volunteer
        theta = zip(THETA, volunteer.theta, strict=True)
        own = {shown.head: shown.text(getattr(volunteer, name)) for name, shown in SHOWN.items()}
        rows.append(
            {
                "": volunteer.context.subject,
                **{f"{parameter.text} ({parameter.unit})": f"{value:g}" for parameter, value in theta},
                "late diastole (kPa)": f"{volunteer.late_diastolic_kpa:g}",
                "a (kPa)": f"{truth.passive_scale_kpa:.2f}",
                **own,
            }
        )
    return pd.DataFrame(rows)


def _haemodynamic_rows(truths: Sequence[Truth]) -> pd.DataFrame:
    rows = []
    for truth in truths:
        context, beat = truth.volunteer.context, haemodynamics(truth)
        pressure = [beat[f"{when}_aortic_pressure_mmhg"] for when in ("systolic", "diastolic")]
        rows.append(
            {
                "": context.subject,
                "EDV / LVEDV (mL)": f"{beat['end_diastolic_volume_ml']:.0f} / {context.lvedv_ml:.0f}",
                "ESV / LVESV (mL)": f"{beat['end_systolic_volume_ml']:.0f} / {context.lvesv_ml:.0f}",
                "EF": f"{beat['ejection_fraction']:.2f}",
                "aortic pressure (mmHg)": "/".join(f"{value:.0f}" for value in pressure),
                "peak ventricular pressure (mmHg)": f"{beat['peak_ventricular_pressure_mmhg']:.0f}",
                "ejection (ms)": f"{beat['ejection_ms']:.0f}",
            }
        )
    return pd.DataFrame(rows)


def _measured_rows(truths: Sequence[Truth], measures: Sequence[ClinicalMeasures]) -> pd.DataFrame:
    rows = []
    for truth, measured in zip(truths, measures, strict=True):
        true = true_measures(truth)
        rows.append(
            {
                "": truth.volunteer.context.subject,
                "aorta (mmHg)": f"{true.sbp_mmhg:.0f}/{true.dbp_mmhg:.0f}",
                "cuff (mmHg)": f"{measured.sbp_mmhg:.0f}/{measured.dbp_mmhg:.0f}",
                "ejection (ms)": f"{true.lvet_ms:.0f}",
                "measured (ms)": f"{measured.lvet_ms:.0f}",
            }
        )
    return pd.DataFrame(rows)


def _clinical_errors() -> dict[str, str]:
    """Return bias and standard deviation of the measures, in words."""
    errors = CLINICAL_ERRORS
    return {
        "sbp_error": f"{errors.sbp_bias_mmhg:+g} +- {errors.sbp_sd_mmhg:g} mmHg",
        "dbp_error": f"{errors.dbp_bias_mmhg:+g} +- {errors.dbp_sd_mmhg:g} mmHg",
        "lvet_error": f"+- {errors.lvet_sd_ms:g} ms",
    }


def _sample_rows(truths: Sequence[Truth], recordings: Sequence[Samples]) -> pd.DataFrame:
    rows = []
    for truth, samples in zip(truths, recordings, strict=True):
        row: dict[str, str] = {"": truth.volunteer.context.subject, "attempted": str(len(samples.status))}
        for status in (STATUS_OK, "no_wave", "motion", "low_r2", "bound_hit"):
            row[status] = str(int((samples.status == status).sum()))
        rows.append(row | {"wrong waves": f"{truth.volunteer.acquisition.outlier_fraction:.0%}"})
    return pd.DataFrame(rows)


def _speed_rows(truths: Sequence[Truth], recordings: Sequence[Samples]) -> pd.DataFrame:
    rows = []
    for truth, samples in zip(truths, recordings, strict=True):
        speeds = summarise_speeds(samples, truth)
        values = (speeds.late_diastolic_m_s, speeds.peak_m_s, speeds.closure_m_s, speeds.stiffness_ratio)
        rows.append((truth.volunteer.context.subject, *(f"{value:.2f}" for value in values)))
    ranges = (LATE_DIASTOLIC_SPEED_M_S, PEAK_SPEED_M_S, CLOSURE_SPEED_M_S, STIFFNESS_RATIO)
    rows.append(("published", *(f"{low:g} to {high:g}" for low, high in ranges)))
    heads = ("late diastole (m/s)", "peak (m/s)", "aortic valve closure (m/s)", "E peak / E late diastole")
    return pd.DataFrame(rows, columns=["", *heads])
