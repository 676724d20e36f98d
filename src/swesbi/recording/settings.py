"""Settings of ingestion, of the cohort's noise and of virtual acquisition; one subject's context row."""

from __future__ import annotations

import re
from typing import Annotated, Final, Literal, Self

from pydantic import Field, model_validator

from swesbi.base.settings import CycleWindow, Settings
from swesbi.context import CONTEXT_BOUNDS, Context, check_bounds, check_ranges

SUBJECT_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9_-]*$"
SUBJECT_LENGTH = 64
# In health 0.5 to 0.75, in the most dilated heart 0.1 (Lang et al. 2015); beyond, a volume has another unit.
EJECTION_FRACTION_RANGE = (0.03, 0.9)
# In health 29 to 75 mL/m2; from small restrictive to the most dilated ventricles (Lang et al. 2015).
LVEDV_INDEX_RANGE_ML_M2 = (15.0, 300.0)
Fraction = Annotated[float, Field(ge=0, lt=1)]
ACQUISITION_SEED: Final = 1
"""Seed of the shipped recordings, fixed before any inference was run on them."""


def is_subject(name: str) -> bool:
    """Tell whether a subject's name is safe as the name of a file."""
    return len(name) <= SUBJECT_LENGTH and re.fullmatch(SUBJECT_PATTERN, name) is not None


class RecordingSettings(Settings):
    """Quality control of the samples, averaging, and which recordings are complete enough to be used."""

    phases: int = Field(ge=6, le=400, description="Number of ECG-gated phases that were attempted.")
    density_kg_m3: float = Field(gt=0, description="Tissue density rho of E = 3 rho c_s^2.")
    min_fit_r2: float = Field(
        ge=0,
        le=1,
        description="Samples whose wave fit has a lower R2 are rejected. Chosen: a wave fit that explains "
        "less of the variance is no wave.",
    )
    max_rr_deviation_fraction: float = Field(
        gt=0,
        lt=1,
        description="Beats whose RR differs by more from the recording's median are ectopic; the median "
        "itself may differ by no more from 60 / HR of the context. It is the 20 % filter of "
        "heart-rate-variability analysis (Malik et al. 1989).",
    )
    outlier_max_abs_z: float = Field(
        gt=0,
        description="Largest robust z-score, against the phase median, of an accepted speed. It is the "
        "modified z-score of Iglewicz and Hoaglin (1993). Of a phase or a push it is against its neighbours.",
    )
    outlier_min_scale_fraction: float = Field(
        gt=0,
        description="Lower limit of the robust scale, as a fraction of the phase median. Chosen: a "
        "recording without scatter rejects nothing within 7 %. Of a phase or a push beside its neighbours it "
        "is the least error.",
    )
    outlier_change_per_tenth_log_sd: float = Field(
        gt=0,
        le=2,
        description="How far the log of the speed wanders in a tenth of the cycle, one standard deviation: "
        "phases and pushes farther from what their neighbours say are outliers. Chosen: of the model's own "
        "clean phases and pushes fewer than 1 in 1000 are left out.",
    )
    outlier_min_points: int = Field(
        ge=3,
        description="Fewest phases or pushes of a recording that are held against their neighbours. Chosen: "
        "ten pushes have none.",
    )
    min_samples_per_phase: int = Field(
        ge=1,
        description="Accepted samples that a measured phase needs. Chosen: a sixth of 3 repeats x 12 "
        "samples.",
    )
    min_repeats_per_phase: int = Field(
        ge=2,
        description="Repeats, with accepted samples, that it needs. It is the least from which a standard "
        "error can be estimated.",
    )
    max_missing_fraction: float = Field(
        ge=0, lt=1, description="Largest share of missing phases. Chosen: at most 4 of 20 phases."
    )
    max_gap_fraction: float = Field(
        gt=0,
        lt=1,
        description="Longest stretch of the cycle between neighbouring measured phases. Chosen: at most "
        "two neighbouring phases of 20, give or take 0.01 as beats differ.",
    )
    late_diastolic_window: CycleWindow = Field(
        description="Part of the cycle in which measured phases of late diastole are counted. It lies "
        "after rapid filling and before the next activation."
    )
    min_late_diastolic_phases: int = Field(
        ge=1,
        description="Measured phases needed in that window. Chosen: the passive baseline rests on these "
        "phases alone.",
    )


class ContextRow(Settings):
    """One row of ``subjects.csv``: the plain twin of :class:`swesbi.context.Context`.

    The bounds catch wrong units; the forward model is declared within those of what it takes.
    """

    subject: str = Field(pattern=SUBJECT_PATTERN, max_length=SUBJECT_LENGTH)
    sex: Literal["F", "M"]
    age_years: float
    bsa_m2: float
    hr_bpm: float
    lvedv_ml: float
    lvesv_ml: float
    ivsd_cm: float

    @model_validator(mode="after")
    def _ejects(self) -> Self:
        check_bounds(self.model_dump(), CONTEXT_BOUNDS)
        if self.lvesv_ml >= self.lvedv_ml:
            raise ValueError(
                f"lvesv_ml ({self.lvesv_ml:g}) must be below lvedv_ml ({self.lvedv_ml:g}); are they swapped?"
            )
        check_ranges(self.to_context())
        fraction = 1.0 - self.lvesv_ml / self.lvedv_ml
        low, high = EJECTION_FRACTION_RANGE
        if not low <= fraction <= high:
            raise ValueError(
                f"lvesv_ml ({self.lvesv_ml:g}) and lvedv_ml ({self.lvedv_ml:g}) make an ejection fraction of "
                f"{fraction:.2f}, expected {low:g} to {high:g}"
            )
        index = self.lvedv_ml / self.bsa_m2
        low, high = LVEDV_INDEX_RANGE_ML_M2
        if not low <= index <= high:
            raise ValueError(
                f"lvedv_ml ({self.lvedv_ml:g}) over bsa_m2 ({self.bsa_m2:g}) is {index:.3g} mL/m2, "
                f"expected {low:g} to {high:g}"
            )
        return self

    def to_context(self) -> Context:
        """Return the same values as a :class:`Context`."""
        return Context(**self.model_dump())


class NoiseSettings(Settings):
    """How the uncertainty of the variance components is estimated.

    The noise of the measured speeds is estimated from the repeats of the whole cohort. Experiments of
    kind `speeds` use it.
    """

    interval: float = Field(
        gt=0,
        lt=1,
        description="Mass of the profile-likelihood intervals of its components. Chosen: they are shown "
        "and change nothing.",
    )


Repeats = Literal["separate", "sweeps"]
"""Whether each phase is repeated by itself, or a repeat of one number runs over all."""
OTHERS: Final = "others"
"""The group of the recordings that no group of ``noise_groups`` names."""


class NoiseDeclaration(Settings):
    """Section ``noise`` of ``recording.yaml``: what is known of the errors of a recording without repeats."""

    fit_points: int | None = Field(default=None, ge=3, le=100_000, description="points of each line fit")
    cv_fraction: float | None = Field(
        default=None, gt=0.0, le=0.5, description="median of the prior of the relative standard error"
    )
    cv_log_sd: float | None = Field(
        default=None, gt=0.0, le=1.5, description="standard deviation of its logarithm"
    )

    @model_validator(mode="after")
    def _one(self) -> Self:
        if (self.cv_fraction is None) != (self.cv_log_sd is None):
            raise ValueError("cv_fraction and cv_log_sd belong together: give both")
        if self.fit_points is not None and self.cv_fraction is not None:
            raise ValueError("declares fit_points and cv_fraction: keep one")
        return self


class NoisePriorSettings(Settings):
    """What is expected of the noise of a laboratory that nobody has seen: log-normal, of each component."""

    repeat_fraction: float = Field(
        gt=0,
        lt=0.5,
        description="Median of the relative standard deviation between repeats. Chosen as of `acquisition`.",
    )
    sample_fraction: float = Field(
        gt=0,
        lt=0.5,
        description="Likewise between samples of a repeat. With repeats and sweeps a single speed varies by "
        "6.9 %, in pigs by 7 % (Vos et al., IEEE Int Ultrason Symp 2016).",
    )
    sweep_fraction: float = Field(
        gt=0,
        lt=0.5,
        description="Likewise between sweeps, where repeats are such. Chosen likewise.",
    )
    log_sd: float = Field(
        gt=0,
        lt=3,
        description="Standard deviation of the logarithm of each. Chosen: a system has a quarter to four "
        "times as much (two standard deviations).",
    )


class EctopicBeat(Settings):
    """One repeat at one phase falls into a premature beat."""

    phase_index: int = Field(ge=0, description="Number of the phase, from 0.")
    repeat: int = Field(ge=0, description="Number of the repeat, from 0.")
    rr_ratio: float = Field(gt=0.2, lt=1, description="RR of that beat over the subject's mean RR.")


class AcquisitionSettings(Settings):
    """How often each phase is measured, and everything that goes wrong.

    Standard deviations are relative to the speed. Each sample has an error of its own and shares one
    with the samples of its repeat; both are independent for each phase and repeat. Two more may be
    shared: by the repeats of one number at all phases, which then are a sweep over the cycle, and by
    the whole recording.
    """

    phases: int = Field(
        ge=6,
        description="Gated phases, at the centres of equal parts of the cycle; must equal "
        "recording.phases (paper, Sec. 2.1).",
    )
    repeats: int = Field(ge=2, description="Acquisitions a phase. Chosen.")
    samples_per_repeat: int = Field(ge=1, description="Positions along the mid-myocardium. Chosen.")
    sample_sd_fraction: Fraction = Field(
        description="Error of one spatial sample. Chosen: a single speed then varies by 6.9 % about its "
        "phase, in pigs by 7 % (Vos et al., IEEE Int Ultrason Symp 2016)."
    )
    repeat_sd_fraction: Fraction = Field(
        description="Error common to the samples of a repeat. Chosen likewise, half that of a sample."
    )
    sweep_fraction: Fraction = Field(
        description="Standard deviation of the error that a repeat shares over all phases; 0 where "
        "repeats are separate. Chosen: repeats are sweeps, and it is half of a repeat's at one phase."
    )
    scale_fraction: Fraction = Field(
        description="Standard deviation of the logarithm of one scale, common to all speeds of a "
        "recording. It stands for plate thickness, fibre angle and dispersion. Chosen: systems differ by "
        "about this on phantoms (RSNA/QIBA)."
    )
    rr_sd_fraction: Fraction = Field(
        description="Beat-to-beat variation of the RR interval. Chosen: at rest."
    )
    failed_fraction: Fraction = Field(description="Samples without an accepted wave fit. Chosen.")
    outlier_fraction: Fraction = Field(description="Samples that report a wrong wave. Chosen.")
    missing_phases: tuple[int, ...] = Field(
        description="Phases at which every sample fails. Must be empty: each synthetic recording misses "
        "the phases that its subject's does."
    )
    ectopic_beats: tuple[EctopicBeat, ...] = Field(
        description="Repeats that fall into a premature beat. Chosen."
    )
    density_kg_m3: float = Field(
        gt=0,
        description="Density rho of E = 3 rho c_s^2; must equal recording.density_kg_m3 (paper, Sec. 2.1).",
    )


ACQUISITION: Final = AcquisitionSettings(
    phases=20,
    repeats=3,
    samples_per_repeat=12,
    sample_sd_fraction=0.06,
    repeat_sd_fraction=0.03,
    sweep_fraction=0.015,
    scale_fraction=0.05,
    rr_sd_fraction=0.01,
    failed_fraction=0.08,
    outlier_fraction=0.03,
    missing_phases=(),
    ectopic_beats=(),
    density_kg_m3=1000.0,
)
"""The common protocol: 20 phases as in the paper, and noise as a laboratory may have it.

A single speed varies as in pigs (Vos et al., IEEE Int Ultrason Symp 2016). The errors that a recording shares
are chosen: a sweep's is half that of a repeat; the scale is of the order by which systems differ on phantoms
(Palmeri et al., J Ultrasound Med 40:569, 2021).
"""
