"""The tables of the virtual cohort and its README, written from the same numbers as its files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Final

import numpy as np
import pandas as pd

from swesbi.arrays import FloatArray
from swesbi.parameters import PASSIVE_SCALE, THETA, THETA_NAMES
from swesbi.recording.phases import to_grid
from swesbi.recording.samples import STATUS_OK, Samples
from swesbi.virtual_cohort.volunteers import LATE_DIASTOLE, OWN_PARAMETERS, SHOWN, Truth

FINE_GRID: Final = 2001


LATE_DIASTOLIC_SPEED_M_S: Final = (0.87, 1.51)


PEAK_SPEED_M_S: Final = (2.1, 5.5)


CLOSURE_SPEED_M_S: Final = (2.5, 4.5)


STIFFNESS_RATIO: Final = (5.0, 25.0)


EJECTION_MS: Final = (292.0, 23.0)


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


def context_table(truths: Sequence[Truth]) -> pd.DataFrame:
    """Return the rows of ``subjects.csv``."""
    return pd.DataFrame([asdict(truth.volunteer.context) for truth in truths])


def truth_table(truths: Sequence[Truth]) -> pd.DataFrame:
    """Return one row a volunteer: true theta, passive scale, and the parameters of the richer physiology."""
    return pd.DataFrame([_truth_row(truth) for truth in truths])


def curve_table(truths: Sequence[Truth]) -> pd.DataFrame:
    """Return the noiseless curves: one row per volunteer and cycle point."""
    return pd.concat([_curve_rows(truth) for truth in truths], ignore_index=True)


def haemodynamics(truth: Truth) -> dict[str, float]:
    """Return what the true beat does: volumes, ejection fraction, pressures, length of ejection."""
    beats, context = truth.beats, truth.volunteer.context
    ejecting = np.mean(beats.aortic_flow_ml_s[0] > 0.0)
    return {
        "end_diastolic_volume_ml": float(beats.end_diastolic_volume_ml[0]),
        "end_systolic_volume_ml": float(beats.end_systolic_volume_ml[0]),
        "ejection_fraction": float(beats.ejection_fraction[0]),
        "peak_ventricular_pressure_mmhg": float(beats.ventricular_pressure_mmhg[0].max()),
        "systolic_arterial_pressure_mmhg": float(beats.arterial_pressure_mmhg[0].max()),
        "diastolic_arterial_pressure_mmhg": float(beats.arterial_pressure_mmhg[0].min()),
        "ejection_ms": float(1e3 * ejecting * context.period_s),
    }


def _truth_row(truth: Truth) -> dict[str, str | float]:
    volunteer = truth.volunteer
    theta = dict(zip(THETA_NAMES, volunteer.theta, strict=True))
    physiology = {name: getattr(volunteer, name) for name in OWN_PARAMETERS}
    scale = round(truth.passive_scale_kpa, 4)
    return {"subject": volunteer.context.subject, **theta, PASSIVE_SCALE.name: scale, **physiology}


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


TEXT: Final = """# Six virtual volunteers

**These are not people.** The volunteers of the paper are not public, and no public time-resolved recording
of cardiac shear wave elastography was found. So the study ships six virtual volunteers, A to F, in the file
format that real recordings would have. Every figure and table that shows them says so.

![The six recordings](recordings.png)

| file | content |
|---|---|
| `subjects.csv` | context: sex, age, body surface area, heart rate, LV volumes, septal thickness |
| `swe/<subject>.csv` | raw samples, one row per attempted push sample |
| `recording.yaml` | how the recordings were made |
| `truth.csv`, `truth_curves.csv` | true theta and noiseless curves; no stage of the inference reads them |

Regenerate all of it, byte for byte, with

```
python -m swesbi.virtual_cohort data/virtual_volunteers
```

The acquisition seed is {seed}; it was fixed before any inference was run on the recordings.

## Where they come from

Each volunteer is one periodic beat of the spherical ventricle in a closed circulation, under a physiology
that is *richer* than the inference model, so that inference meets model error as it would in life: valve
inertance, wall inertia, a slower activation ramp (30 ms instead of 20), and the parameters below, each
volunteer's own. The total stiffness is `a exp(b (lambda^2 - 1)) + k_c` along the volunteer's own beat; the
scale `a` is set so that the late-diastolic mean is the designed one.

{truth}

`wall` multiplies the passive C_0 and C_2 of the PhysioBlocks 2.0.1 human heart. What each volunteer is for:

{designs}

Whether a volunteer passes the prior-support test is an outcome, not part of the design.

What the true beats do, beside the volumes in `subjects.csv`:

{haemodynamics}

Three things are not as in life, and are left so: ejection is short in A to D (published left ventricular
ejection time: {ejection_mean:.0f} +- {ejection_sd:.0f} ms); end-systolic volumes, save D's, lie below the
listed ones, which inference uses only as conditioning variables; peak ventricular pressure is high, above
all where contraction is fast (E, F).

## Acquisition noise

20 gated phases, 3 repeats of 12 spatial samples. Each speed carries an error of 8 % of its own and shares
one of 4 % with its repeat, independent for each phase and repeat: 2.7 % on a phase mean. RR varies by 1 %
from beat to beat; the push comes at a fixed delay, so the phase varies with it. About 8 % of the samples
fail, 2 to 4 % report a wrong wave. Phase 13 of B and phase 4 of E failed altogether; one repeat of C fell
into a premature beat.

{samples}

## Speeds beside published ones

From the median of the successful samples at each phase; *closure* is when forward flow through the aortic
valve ends.

{speeds}
{seeds}
## Sources

- Diastolic septal speed, parasternal long axis, in healthy volunteers: Song et al., J Ultrasound Med 35:1419
  (2016), and paediatric series.
- Systolic speed, by acoustic radiation force in open-chest sheep: Couade et al., IEEE Trans Med Imaging
  30:295 (2011).
- Speed of natural waves at valve closure, in volunteers: Santos et al., IEEE Trans Ultrason Ferroelectr Freq
  Control 66:442 (2019); Keijzer et al., ibid. 67:1590 (2020).
- Noise of 8 % and 4 %: chosen, of the order of the standard deviation of 7 % reported with acoustic radiation
  force in pigs (Vos et al., IEEE International Ultrasonics Symposium 2016).
- Volumes, wall thickness, ejection fraction: Lang et al., J Am Soc Echocardiogr 28:1 (2015).
- Mechanics: Chapelle et al., Int J Multiscale Comput Eng 10:189 (2012); Caruel et al., Biomech Model
  Mechanobiol 13:897 (2014).
"""


SEEDS: Final = """
## Other acquisition seeds

The same volunteers, recorded anew with other noise (`record(truth, seed)`), each recording ingested, its
passive baseline calibrated anew, and judged by the network of the study's main experiment, which was not
trained again. Out of {seeds} recordings each, the prior supports {supported}.
The shipped seed stays {seed}, whatever its own recordings came to.

{table}

`acquisition_seeds.csv` holds this table; `make acquisition-seeds` makes it anew after a run of the study, and
puts one row for each recording into `results/tables/acquisition_seeds.csv`.

- `seeds`: recordings; `seeds_within_z`: those with every |z| of the conditioning vector within the limit;
  `seeds_enough_draws`: those with enough posterior draws within the prior's bounds; `seeds_supported`: both.
- `max_abs_z`: largest |z|, median over all recordings; `rmse_prior_kpa`: error of the prior predictive
  median, likewise.
- `rmse_kpa`, `rmse_reduction_percent`, `r2`: error of the posterior predictive median, its reduction against
  the prior's, coefficient of determination; `coverage_grid`, `coverage_phases`: share of the analysis grid
  and of the measured phases inside the 90 % predictive interval; medians over the supported recordings,
  empty where there is none.
"""


def readme(
    truths: Sequence[Truth], recordings: Sequence[Samples], seed: int, seed_medians: pd.DataFrame | None
) -> str:
    """Return the text of the README.

    Args:
        truths: The volunteers' true beats.
        recordings: Their recordings, in the same order.
        seed: The acquisition seed.
        seed_medians: Results over acquisition seeds, as texts, shown as they are; None if there are none yet.
    """
    designs = "\n".join(f"- {t.volunteer.context.subject}: {t.volunteer.design}" for t in truths)
    return TEXT.format(
        seed=seed,
        truth=markdown(_truth_rows(truths)),
        designs=designs,
        haemodynamics=markdown(_haemodynamic_rows(truths)),
        ejection_mean=EJECTION_MS[0],
        ejection_sd=EJECTION_MS[1],
        samples=markdown(_sample_rows(truths, recordings)),
        speeds=markdown(_speed_rows(truths, recordings)),
        seeds="" if seed_medians is None else _seeds(seed_medians, seed),
    )


def _seeds(medians: pd.DataFrame, seed: int) -> str:
    """Return the section on other acquisition seeds."""
    counts = zip(medians["subject"], medians["seeds_supported"], strict=True)
    return SEEDS.format(
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
        pressure = [beat[f"{when}_arterial_pressure_mmhg"] for when in ("systolic", "diastolic")]
        rows.append(
            {
                "": context.subject,
                "EDV / LVEDV (mL)": f"{beat['end_diastolic_volume_ml']:.0f} / {context.lvedv_ml:.0f}",
                "ESV / LVESV (mL)": f"{beat['end_systolic_volume_ml']:.0f} / {context.lvesv_ml:.0f}",
                "EF": f"{beat['ejection_fraction']:.2f}",
                "arterial pressure (mmHg)": "/".join(f"{value:.0f}" for value in pressure),
                "peak ventricular pressure (mmHg)": f"{beat['peak_ventricular_pressure_mmhg']:.0f}",
                "ejection (ms)": f"{beat['ejection_ms']:.0f}",
            }
        )
    return pd.DataFrame(rows)


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
