"""Make the virtual volunteers anew: ``python data/virtual_volunteers/make.py [FOLDER]``.

README.md beside it says what they are.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

sys.path.insert(0, str(Path(__file__).parents[2]))  # the project's folder, where `data` is found

from data.makers.clinical import CLINICAL_ERRORS, measure, true_measures
from data.makers.files import RECORDING, write_csv, write_recordings, write_text
from data.makers.tables import haemodynamics, markdown, phase_medians, truth_table
from swesbi.measurement.derived import LATE_DIASTOLE
from swesbi.parameters import THETA
from swesbi.recording.cohort.clinical import ClinicalMeasures
from swesbi.recording.phases import to_grid
from swesbi.recording.samples import Samples
from swesbi.recording.settings import ACQUISITION, ACQUISITION_SEED, AcquisitionSettings
from swesbi.recording.tables.layout import STATUS_OK
from swesbi.report.paper.values import read_paper
from swesbi.virtual.volunteers import (
    QUIET,
    SHOWN,
    VOLUNTEERS,
    Truth,
    Volunteer,
    record,
    simulate_truth,
)

SAMPLE_COLOUR = "#9aa7b5"
MEDIAN_COLOUR = "#0b3c6f"
FAILED_COLOUR = "#d55e00"
PUBLISHED_COLOUR = "#009e73"
TOP_M_S = 7.2
FINE_GRID: Final = 2001
LATE_DIASTOLIC_SPEED_M_S: Final = (0.87, 1.51)
PEAK_SPEED_M_S: Final = (2.1, 5.5)
CLOSURE_SPEED_M_S: Final = (2.5, 4.5)
STIFFNESS_RATIO: Final = (5.0, 25.0)
EJECTION_MS: Final = (292.0, 23.0)
PRIOR_RMSE: Final = "RMSE of the prior predictive median (kPa)"
POSTERIOR_RMSE: Final = "RMSE of the posterior predictive median (kPa)"
ORIGIN: Final = "virtual volunteers, simulated by swesbi.virtual"
TEXT: Final = """# Eight virtual volunteers

**These are not people.** The recordings of the paper are not public, and no public time-resolved recording of
cardiac shear wave elastography was found. So the study ships eight virtual volunteers, A to H, in the file
format of real recordings. Every figure and table of them states this.

- **A to F stand for the paper's six cases.** They are designed from the numbers that the paper prints, and
  recorded with little noise. The experiments that repeat the paper use them alone.
- **G and H are recorded as a laboratory records.** G relaxes slower, H faster. The other experiments use all
  eight.

![The eight recordings](recordings.png)

| file | content |
|---|---|
| `subjects.csv` | sex, age, body surface area, heart rate, LV volumes, septum; cuff pressures, ejection |
| `swe/<subject>.csv` | raw samples, one row per attempted push sample |
| `recording.yaml` | how the recordings were made, and whose errors are estimated together |
| `truth.csv`, `truth_curves.csv` | true theta, beats, noiseless curves; no inference reads them |

Regenerate all of it, byte for byte, with

```
python data/virtual_volunteers/make.py
```

The acquisition seed is {seed}. It was fixed before A to F were designed.

## Where they come from

Each volunteer is one periodic beat of the spherical ventricle in a closed circulation. They were simulated
with *another* model than the one we fit, so model error is part of the test. It has valve inertance, wall
inertia, and a slower ramp of activation. Its atria do not contract. The parameters below differ between the
volunteers. The total stiffness is `a exp(b (lambda^2 - 1)) + k_c` along the volunteer's own beat. The scale
`a` is set so that the late-diastolic mean is the designed one.

{truth}

`wall` multiplies the passive C_0 and C_2 of the PhysioBlocks 2.0.1 human heart. The constants that all share
are those of model version 4 in A to F, and those of version 3 in G and H. What each volunteer is for:

{designs}

## What chose A to F

The paper prints no curve, but its table 1 implies some of each. The RMSE over the NRMSE is the range of the
observed curve. The NRMSE over the root of 1 - R2 is its standard deviation over its range.

{shapes}

Printed numbers are rounded, so each range is known to 2 % and each ratio to 10 %. Those of the volunteers are
of the true curves. Their curves are broader than the paper's, since narrower ones would eject too little.

What each number chose:

- **Errors of the prior's median,** {prior} kPa, and ranges: k_0 and k_SR of A to D.
- **sd over range:** k_ATP of A to D. Slow contraction makes a curve narrower, and ejection poorer.
- **Errors of the posterior's median,** {posterior} kPa: exponent, sigma_0, alpha, wall, onset,
  duration and ramp of A to D. They make model error. C is nearest to the model. D errs most, after its peak.
- **The same errors:** constants of version 4 in A to F, since the model has these.
- **The 0.87 kPa of C, and coverages of 0.89 to above 0.99:** repeats share {repeat} and sweeps {sweep}, a
  repeat has {samples_per_repeat} samples, and no scale errs.
- **One draw of 500,000 within the bounds, all z below 3** (2.16): k_0, k_ATP and ramp of E.
- **No draw, and the up-slope alone beyond z = 3** (3.14): k_0, k_ATP, onset and duration of F.
- **No printed number:** R_d, C_s and LVESV, and sigma_0 of E and F. They keep pressures below 140/90 mmHg.

Noise and model error are two parts of one residual. With the noise of a laboratory, coverages fail and R2 is
too small ([side study](../../studies/statements/README.md)).

**The design has seen inference.** Designs were compared by the statements of the paper that they allow, on
acquisition seeds 1 to 6 and one training. The side study judges seed 1, and seeds 7 to 12, which are fresh.
Whether a volunteer passes the prior-support test is an outcome.

## Volumes and pressures

Of the true beats, beside the volumes in `subjects.csv`:

{haemodynamics}

Two things differ from real hearts:

- Ejection is short in all but E (published left ventricular ejection time: {ejection_mean:.0f} +-
  {ejection_sd:.0f} ms).
- End-systolic volumes lie below the listed ones. Inference uses these only as conditioning variables.

## Cuff pressures and ejection time

`sbp_mmhg`, `dbp_mmhg` and `lvet_ms` are clinical measurements of these beats: the largest and the smallest
pressure at the root of the aorta, and the time from the first to the last flow through its valve. They have
the errors of `clinical` in `config/model.yaml`: {sbp_error} and {dbp_error} of the cuff, {lvet_error} of the
ejection. They are rounded. Their random numbers are separate, so that the recordings do not depend on them.

{measures}

**The ejection times are the model's, and shorter than people's** in all but E ({ejection_mean:.0f}
+- {ejection_sd:.0f} ms). They show how the columns work, not how long hearts eject.

## Acquisition noise

20 gated phases, 3 repeats. Each speed has an error of its own and shares one with its repeat, independent for
each phase. Repeats are sweeps over the cycle. Each sweep shares an error over all its phases. A recording has
one scale of all its speeds (thickness of the wall as a plate, fibre angle, dispersion).

{noise}

**The noise of A to F is theirs alone.** It is as small as the paper's residuals imply, and no laboratory has
it. G and H have the noise of `acquisition` in `config/model.yaml`. So have the populations, the trial, the
planning and the validation. Errors of the two groups are estimated apart (`noise_groups` in
`recording.yaml`).

RR varies by 1 % from beat to beat. The push comes at a fixed delay, so the phase varies too. About 8 % of the
samples fail, and 2 to 4 % report a wrong wave. Phase 13 of B and phase 4 of E failed completely. One repeat
of C fell into a premature beat.

{samples}

## Speeds beside published ones

From the median of the successful samples at each phase. *Closure* is the end of forward flow through the
aortic valve.

{speeds}

## Sources

- Diastolic septal speed, parasternal long axis, in healthy volunteers: Song et al., J Ultrasound Med
  35:1419 (2016), and paediatric series.
- Systolic speed, by acoustic radiation force in open-chest sheep: Couade et al., IEEE Trans Med Imaging
  30:295 (2011).
- Speed of natural waves at valve closure, in volunteers: Santos et al., IEEE Trans Ultrason Ferroelectr
  Freq Control 66:442 (2019); Keijzer et al., ibid. 67:1590 (2020).
- Noise of G and H: chosen, so that a single speed varies by {single} about its phase. 7 % is reported with
  acoustic radiation force in pigs (Vos et al., IEEE International Ultrasonics Symposium 2016).
- Their error of a sweep: chosen, half that of a repeat at one phase, since a probe that is placed again finds
  nearly the same wall. Their scale: chosen; systems differ by about this on phantoms (RSNA/QIBA; Palmeri
  et al., J Ultrasound Med 40:569, 2021).
- Volumes, wall thickness, ejection fraction: Lang et al., J Am Soc Echocardiogr 28:1 (2015).
- Mechanics: Chapelle et al., Int J Multiscale Comput Eng 10:189 (2012); Caruel et al., Biomech Model
  Mechanobiol 13:897 (2014).
"""
NOISE_GROUPS: Final = """noise_groups:           # their errors are estimated apart from those of the others
  quiet: [{quiet}]
"""


@dataclass(frozen=True)
class SpeedSummary:
    """What a recording says at a glance, from the medians of its successful samples.

    ``closure_m_s`` is the speed when forward flow through the aortic valve ends in the true beat.
    """

    late_diastolic_m_s: float
    peak_m_s: float
    closure_m_s: float
    stiffness_ratio: float


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


def curve_table(truths: Sequence[Truth]) -> pd.DataFrame:
    """Return the noiseless curves: one row per volunteer and cycle point."""
    return pd.concat([_curve_rows(truth) for truth in truths], ignore_index=True)


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
    truths: Sequence[Truth], recordings: Sequence[Samples], measures: Sequence[ClinicalMeasures], seed: int
) -> str:
    """Return the text of the README; truths, recordings and measures are in the same order of volunteers."""
    designs = "\n".join(f"- {t.volunteer.context.subject}: {t.volunteer.design}" for t in truths)
    errors = ACQUISITION
    single = math.hypot(errors.sample_sd_fraction, errors.repeat_sd_fraction, errors.sweep_fraction)
    quiet = ACQUISITION.model_copy(update=QUIET)
    return TEXT.format(
        seed=seed,
        truth=markdown(_truth_rows(truths)),
        designs=designs,
        shapes=markdown(_shape_rows(truths)),
        prior=", ".join(f"{value:.2f}" for value in _printed(PRIOR_RMSE).values()),
        posterior=", ".join(f"{value:.2f}" for value in _printed(POSTERIOR_RMSE).values()),
        repeat=_percent(quiet.repeat_sd_fraction),
        sweep=_percent(quiet.sweep_fraction),
        samples_per_repeat=quiet.samples_per_repeat,
        haemodynamics=markdown(_haemodynamic_rows(truths)),
        measures=markdown(_measured_rows(truths, measures)),
        **_clinical_errors(),
        ejection_mean=EJECTION_MS[0],
        ejection_sd=EJECTION_MS[1],
        noise=markdown(_noise_rows({"A to F": quiet, "G and H": errors})),
        samples=markdown(_sample_rows(truths, recordings)),
        speeds=markdown(_speed_rows(truths, recordings)),
        single=f"{100.0 * single:.1f} %",
    )


def _percent(fraction: float) -> str:
    return f"{100.0 * fraction:g} %"


def _noise_rows(groups: Mapping[str, AcquisitionSettings]) -> pd.DataFrame:
    """Return the errors of a speed by group: each of them, and of the mean of a phase without the scale."""
    rows = []
    for name, noise in groups.items():
        own, repeat, samples = noise.sample_sd_fraction, noise.repeat_sd_fraction, noise.samples_per_repeat
        mean = math.sqrt((own**2 / samples + repeat**2 + noise.sweep_fraction**2) / noise.repeats)
        rows.append(
            {
                "": name,
                "sample": _percent(own),
                "samples a repeat": str(samples),
                "repeat": _percent(repeat),
                "sweep": _percent(noise.sweep_fraction),
                "scale": _percent(noise.scale_fraction),
                "mean of a phase": f"{100.0 * mean:.2f} %",
            }
        )
    return pd.DataFrame(rows)


def _printed(quantity: str) -> dict[str, float]:
    """Return a quantity that the paper prints for each case, by the volunteer that stands for it."""
    return {number.case: number.value for number in read_paper() if number.row.quantity == quantity}


def _shape_rows(truths: Sequence[Truth]) -> pd.DataFrame:
    """Return range and relative spread of the curves: by table 1 of the paper, and as they are."""
    rmse_kpa, nrmse, r2 = map(_printed, (POSTERIOR_RMSE, "NRMSE", "R2"))
    rows = []
    for truth in truths:
        name, curve = truth.volunteer.context.subject, truth.curve.stiffness_kpa
        if name in rmse_kpa:
            spread, extent = nrmse[name] / math.sqrt(1.0 - r2[name]), float(np.ptp(curve))
            rows.append(
                {
                    "case": name,
                    "range (kPa), paper": f"{rmse_kpa[name] / nrmse[name]:.1f}",
                    "range here": f"{extent:.1f}",
                    "sd over range, paper": f"{spread:.2f}",
                    "ratio here": f"{float(curve.std()) / extent:.2f}",
                }
            )
    return pd.DataFrame(rows)


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


def draw_recordings(volunteers: Sequence[Volunteer], recordings: Sequence[Samples]) -> Figure:
    """Draw every successful sample, the phase medians, the share that failed, and published ranges."""
    figure, axes = plt.subplots(2, 4, figsize=(12.5, 6.0), sharex=True, sharey=True, layout="constrained")
    for axis, volunteer, samples in zip(axes.flat, volunteers, recordings, strict=True):
        _draw_recording(axis, samples)
        context = volunteer.context
        axis.set_title(
            f"{context.subject}: {context.sex}, {context.age_years:.0f} years, {context.hr_bpm:.0f} bpm",
            fontsize=10,
        )
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    for axis in axes[-1]:
        axis.set_xlabel("phase of the cardiac cycle, from the R peak", fontsize=9)
    for axis in axes[:, 0]:
        axis.set_ylabel("shear-wave speed $c_s$ (m/s)", fontsize=9)
    figure.suptitle("Raw recordings of the virtual volunteers", fontsize=12)
    return figure


def _draw_recording(axis: Axes, samples: Samples) -> None:
    phase, median = phase_medians(samples)
    axis.fill_between(LATE_DIASTOLE, *LATE_DIASTOLIC_SPEED_M_S, color=PUBLISHED_COLOUR, alpha=0.35, lw=0)
    axis.fill_between(
        (0.3, 0.5), *PEAK_SPEED_M_S, color=PUBLISHED_COLOUR, alpha=0.15, lw=0, label="published range"
    )
    axis.plot(samples.beat_phase, samples.speed_m_s, ".", ms=2.5, color=SAMPLE_COLOUR, label="sample")
    axis.plot(phase, median, "o-", ms=3.5, lw=1.2, color=MEDIAN_COLOUR, label="median of a phase")
    attempted = np.bincount(samples.phase_index)
    failed = np.bincount(samples.phase_index, weights=np.isnan(samples.speed_m_s)) / attempted
    centre = np.bincount(samples.phase_index, weights=samples.beat_phase) / attempted
    axis.bar(centre, failed, width=0.025, color=FAILED_COLOUR, label="failed samples (bar of height 1: all)")
    axis.set(xlim=(0.0, 1.0), ylim=(0.0, TOP_M_S))
    axis.tick_params(labelsize=9)


def write_cohort(folder: Path, seed: int) -> None:
    """Write contexts, recordings, truth, picture and README of the volunteers into ``folder``."""
    truths = [simulate_truth(volunteer) for volunteer in VOLUNTEERS]
    recordings = [record(truth, seed) for truth in truths]
    measures = [measure(truth, seed) for truth in truths]
    write_recordings(
        folder, {t.volunteer.context.subject: own for t, own in zip(truths, recordings, strict=True)}
    )
    write_csv(folder / "subjects.csv", subject_table(truths, measures))
    write_csv(folder / "truth.csv", truth_table(truths))
    write_csv(folder / "truth_curves.csv", curve_table(truths), "%.4f")
    write_text(folder / "recording.yaml", recording_yaml(seed))
    write_text(folder / "README.md", readme(truths, recordings, measures, seed))
    _write_picture(folder / "recordings.png", recordings)


def recording_yaml(seed: int) -> str:
    """Return how the recordings were made; the quiet ones are a noise group of their own."""
    by_noise: dict[str, list[str]] = {"quiet": [], "others": []}
    for volunteer in VOLUNTEERS:
        quiet = volunteer.acquisition.samples_per_repeat == QUIET["samples_per_repeat"]
        by_noise["quiet" if quiet else "others"].append(volunteer.context.subject)
    named, others = (", ".join(names) for names in by_noise.values())
    samples = f"{QUIET['samples_per_repeat']} # of {others}: {ACQUISITION.samples_per_repeat}"
    return RECORDING.format(origin=ORIGIN, seed=seed, samples=samples) + NOISE_GROUPS.format(quiet=named)


def _write_picture(path: Path, recordings: Sequence[Samples]) -> None:
    with plt.style.context("default"):
        figure = draw_recordings(VOLUNTEERS, recordings)
        figure.savefig(path, dpi=130, metadata={"Software": None})
        plt.close(figure)


def main() -> None:
    """Write the virtual volunteers into a folder."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument(
        "folder", type=Path, nargs="?", default=Path(__file__).parent, help="default: that of this program"
    )
    parser.add_argument(
        "--acquisition-seed", type=int, default=ACQUISITION_SEED, help="noise of the recordings"
    )
    arguments = parser.parse_args()
    matplotlib.use("Agg")
    write_cohort(arguments.folder, arguments.acquisition_seed)


if __name__ == "__main__":
    main()
