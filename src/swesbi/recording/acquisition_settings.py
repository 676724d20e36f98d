"""The acquisition of a virtual recording: gating, repeats, noise, failures."""

from __future__ import annotations

from typing import Annotated, Final

from pydantic import Field

from swesbi.base.settings import Settings

Fraction = Annotated[float, Field(ge=0, lt=1)]
ACQUISITION_SEED: Final = 1
"""Seed of the shipped recordings, fixed before any inference was run on them."""


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
