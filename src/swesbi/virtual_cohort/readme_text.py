"""What the cohort's README says around its tables."""

from typing import Final

TEXT: Final = """# Eight virtual volunteers

**These are not people.** The volunteers of the paper are not public, and no public time-resolved recording
of cardiac shear wave elastography was found. So the study ships eight virtual volunteers, A to H, in the file
format that real recordings would have. Every figure and table that shows them says so. A to F stand where the
paper has its six cases, and the experiments that repeat the paper are made of them; G and H, who relax slower
and faster than those, are in the others too.

![The eight recordings](recordings.png)

| file | content |
|---|---|
| `subjects.csv` | sex, age, body surface area, heart rate, LV volumes, septum; cuff pressures, ejection |
| `swe/<subject>.csv` | raw samples, one row per attempted push sample |
| `recording.yaml` | how the recordings were made |
| `truth.csv`, `truth_curves.csv` | true theta, beats, noiseless curves; no stage of inference reads them |

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

Theta of A to D were chosen with the prior errors of the paper's cases in view, those of E and F so that the
prior should not support them. Whether a volunteer passes the prior-support test is an outcome of that.

What the true beats do, beside the volumes in `subjects.csv`:

{haemodynamics}

Three things are not as in life, and are left so: ejection is short in all but E and F (published left
ventricular ejection time: {ejection_mean:.0f} +- {ejection_sd:.0f} ms); end-systolic volumes, save D's, lie
below the listed ones, which inference uses only as conditioning variables; pressures of ventricle and aorta
are high, above all where contraction is fast (E, F).

## Cuff pressures and ejection time

`sbp_mmhg`, `dbp_mmhg` and `lvet_ms` are what a clinic would measure of these beats: the largest and least
pressure at the root of the aorta, and the time from the first to the last flow through its valve, with the
errors of `clinical` in `config.yaml`: {sbp_error} and {dbp_error} of the cuff, {lvet_error}
of the ejection. They are rounded, and drawn from random numbers of their own, so that the recordings are
what they were without them.

{measures}

**The ejection times are the model's, and shorter than people's** in all but E and F ({ejection_mean:.0f}
+- {ejection_sd:.0f} ms): they show what the columns do, not how long hearts eject.

## Acquisition noise

20 gated phases, 3 repeats of 12 spatial samples. Each speed carries an error of {sample} of its own and
shares one of {repeat} with its repeat, independent for each phase. Repeats are sweeps over the cycle: each
shares an error of {sweep} over all its phases, and a recording has one scale of all its speeds, known to
{scale} (thickness of the wall as a plate, fibre angle, dispersion). Without the scale that is {phase_se} on
a phase mean. RR varies by 1 % from beat to beat; the push comes at a fixed delay, so the phase varies with
it. About 8 % of the samples fail, 2 to 4 % report a wrong wave. Phase 13 of B and phase 4 of E failed
altogether; one repeat of C fell into a premature beat.

{samples}
{levels}
## Speeds beside published ones

From the median of the successful samples at each phase; *closure* is when forward flow through the aortic
valve ends.

{speeds}
{seeds}
## Sources

- Diastolic septal speed, parasternal long axis, in healthy volunteers: Song et al., J Ultrasound Med
  35:1419 (2016), and paediatric series.
- Systolic speed, by acoustic radiation force in open-chest sheep: Couade et al., IEEE Trans Med Imaging
  30:295 (2011).
- Speed of natural waves at valve closure, in volunteers: Santos et al., IEEE Trans Ultrason Ferroelectr
  Freq Control 66:442 (2019); Keijzer et al., ibid. 67:1590 (2020).
- Noise of {sample} and {repeat}: chosen by the paper's residuals, as above. A single speed so has a
  standard deviation of {single} about its phase; 7 % is reported with acoustic radiation force in pigs (Vos
  et al., IEEE International Ultrasonics Symposium 2016).
- Error of a sweep: chosen, half that of a repeat at one phase, since a probe that is put back finds nearly
  the same wall. Scale of {scale}: chosen; systems differ by about this on phantoms (RSNA/QIBA; Palmeri et
  al., J Ultrasound Med 40:569, 2021).
- Volumes, wall thickness, ejection fraction: Lang et al., J Am Soc Echocardiogr 28:1 (2015).
- Mechanics: Chapelle et al., Int J Multiscale Comput Eng 10:189 (2012); Caruel et al., Biomech Model
  Mechanobiol 13:897 (2014).
"""


LEVELS: Final = """
### How large it is, and why

The paper prints what is left between its curves and the median of its posterior: RMSE of {paper} kPa for
its cases A, B, C, D, {mean:.2f} in the mean. Noise is part of it and the model's error another, so these
residuals bound the noise of the paper's curves from above. The level in use is the round one at which noise
alone makes {low:.2f} to {high:.2f} kPa in A to D, the paper's mean less 10 to 30 %:

{table}

RMSE on the analysis grid between the curve as ingested and the true one through the same measured phases,
in kPa, in the mean over {seeds} recordings of each volunteer, seeds {first} to {last}; the shipped seed is
none of them. Samples to repeats 2 : 1, sweeps half of the repeats, scale {scale}. The true curve is taken
times the factor that fits best, since a fit takes up a common scale: k_0 and `a` move with it. *As
recorded* is without that factor. Interpolation between 20 phases is in no column, as fitted curves go
through the same phases; the true curves themselves lie {interpolation:.1f} kPa from it. No verdict was
looked at.

8 % and 4 %, at which earlier versions of the cohort were recorded, leave more than the paper's own mean.
Published repeatability bounds less: a single speed varies by {single} about its phase here and by 8.9 %
there; 7 % is reported in pigs (Vos et al. 2016), with another system and view.

`noise_levels.csv` holds this table; `python -m swesbi.virtual_cohort data/virtual_volunteers --noise-levels
config.yaml` measures it anew.
"""


OTHER_SEEDS: Final = """
## Other acquisition seeds

The same volunteers, recorded anew with other noise (`record(truth, seed)`), each recording ingested, its
passive baseline calibrated anew, and judged by the network of the study's main experiment, which was not
trained again. Out of {seeds} recordings each, the prior supports {supported}.
The shipped seed stays {seed}, whatever its own recordings came to.

{table}

`acquisition_seeds.csv` holds this table; the side study `studies/acquisition_seeds` makes it anew after a run
of the study, with a second table of one row for each recording.

- `seeds`: recordings; `seeds_within_z`: those with every |z| of the conditioning vector within the limit;
  `seeds_enough_draws`: those with enough posterior draws within the prior's bounds; `seeds_supported`: both.
- `max_abs_z`: largest |z|, median over all recordings; `rmse_prior_kpa`: error of the prior predictive
  median, likewise.
- `rmse_kpa`, `rmse_reduction_percent`, `r2`: error of the posterior predictive median, its reduction against
  the prior's, coefficient of determination; `coverage_grid`, `coverage_phases`: share of the analysis grid
  and of the measured phases inside the 90 % band of noiseless curves; medians over the supported recordings,
  empty where there is none.
"""
