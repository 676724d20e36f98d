"""The identifiability of one subject, and of a cohort."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from swesbi.artefacts import Part, Variable
from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.base.progress import Progress
from swesbi.checks.identifiability.designs import (
    Designs,
    Placement,
    expected_of_designs,
    place_phases,
)
from swesbi.checks.identifiability.information import (
    Contraction,
    LeftOut,
    PhaseInformation,
    SimulatedStencil,
    contraction,
    expected_sd,
    in_log,
    leave_phases_out,
    log_gradient,
    moments_of_phi,
    phase_information,
    prior_precision,
    prior_quantities,
    quantities,
    simulate_stencil,
)
from swesbi.checks.identifiability.likelihood import (
    MomentDerivatives,
    differentiate,
    expected_information,
    information_by_datum,
    log_likelihood_terms,
)
from swesbi.checks.identifiability.noise import MeanNoise
from swesbi.checks.identifiability.profiles import Profiles, profiles_of
from swesbi.checks.identifiability.settings import IdentifiabilitySettings
from swesbi.measurement.likelihood import SpeedModel
from swesbi.parameters import OF_INTEREST, PHI_COLUMNS
from swesbi.seeds import generator

QUANTITY_COLUMNS: Final = f"{PHI_COLUMNS}, kPa"


@dataclass(frozen=True)
class RecordedSubject:
    """One recording with its posterior.

    Attributes:
        model: The model of its speeds.
        phi: Posterior draws; (n, d).
        phase: All phases of the recording, missing ones too; (P,).
        measured: Which of them were measured; (P,).
        repeat: Noise of one repeat's mean speed.
    """

    model: SpeedModel
    phi: FloatArray
    phase: FloatArray
    measured: BoolArray
    repeat: MeanNoise

    @property
    def name(self) -> str:
        """The subject's name."""
        return self.model.recording.subject

    @property
    def duration_s(self) -> float:
        """Duration of the activation at the posterior's median."""
        return float(np.median(self.model.activation_duration_s(self.phi)))

    @property
    def equivalent_repeats(self) -> float:
        """Repeats of usual size that give the mean square of the recording's own errors."""
        return float(self.repeat.own / np.mean(self.model.recording.relative_se**2))


@dataclass(frozen=True)
class Spread:
    """Posterior spread of q quantities: found, and expected from the information of the recording; (q,) each.

    The expected variance is averaged over posterior draws.
    """

    median: Annotated[FloatArray, Variable("quantity", QUANTITY_COLUMNS, "posterior median")]
    sd_log: Annotated[FloatArray, Variable("quantity", "1", "posterior sd of the log")]
    expected_sd_log: Annotated[
        FloatArray, Variable("quantity", "1", "sd of the log expected from the information")
    ]
    expected_sd_log_at_median: Annotated[
        FloatArray, Variable("quantity", "1", "the same at the posterior median alone")
    ]


@dataclass(frozen=True)
class SubjectIdentifiability:
    """What one recording tells of its subject's parameters.

    Attributes:
        subject: Name.
        spread: Of the posterior.
        contraction: Against the prior.
        profiles: Of the likelihood.
        phases: What each measured phase is expected to tell; (q, p).
        left_out: What the posterior is without each; (q, p).
        designs: What other recordings would tell.
        shown: Posterior draws for the figure; (m, 4).
    """

    subject: str
    spread: Annotated[Spread, Part()]
    contraction: Annotated[Contraction, Part()]
    profiles: Annotated[Profiles, Part(group="profile")]
    phases: PhaseInformation
    left_out: LeftOut
    designs: Annotated[Designs, Part(group="design")]
    shown: FloatArray


def drawn(recorded: RecordedSubject, number: int, seed: int, purpose: str) -> FloatArray:
    """Return ``number`` of the posterior draws (all, if there are fewer), a sample of its own a purpose."""
    rng = generator(seed, "identifiability", purpose, recorded.name)
    rows = rng.permutation(len(recorded.phi))[:number]
    return recorded.phi[np.sort(rows)]


def stencil_of(
    recorded: RecordedSubject, draws: int, settings: IdentifiabilitySettings, seed: int
) -> SimulatedStencil:
    """Simulate the draws that designs are judged by."""
    return simulate_stencil(recorded.model, drawn(recorded, draws, seed, "designs"), settings.difference_step)


def identify(
    recorded: RecordedSubject, settings: IdentifiabilitySettings, seed: int
) -> SubjectIdentifiability:
    """Study the identifiability of one subject."""
    model = recorded.model
    values, step = quantities(model, recorded.phi), settings.difference_step
    simulated = stencil_of(recorded, settings.design.draws, settings, seed)
    informing = drawn(recorded, settings.information_draws, seed, "information")
    moments = moments_of_phi(model, recorded.phi)
    at, information, sd_log = _expected(recorded, informing, step)
    _, _, at_median = _expected(recorded, np.median(recorded.phi, axis=0)[None], step)
    precision, gradient = prior_precision(model.settings.prior), log_gradient(model, informing)
    return SubjectIdentifiability(
        subject=recorded.name,
        spread=Spread(np.median(values, axis=0), np.log(values).std(axis=0), sd_log, at_median),
        contraction=contraction(values, prior_quantities(model)),
        profiles=profiles_of(model, settings, seed),
        phases=phase_information(information, information_by_datum(at), precision, gradient),
        left_out=leave_phases_out(
            np.log(values), log_likelihood_terms(moments, np.log(model.recording.speed_m_s))
        ),
        designs=expected_of_designs(model, simulated, recorded.repeat, settings.design),
        shown=drawn(recorded, settings.shown_draws, seed, "shown")[:, OF_INTEREST],
    )


def _expected(
    recorded: RecordedSubject, phi: FloatArray, step: float
) -> tuple[MomentDerivatives, FloatArray, FloatArray]:
    """Return derivatives of the measured log speeds' moments by log phi (n, d), the information, and sd."""
    at = differentiate(in_log(recorded.model), np.log(phi), step)
    precision, information = prior_precision(recorded.model.settings.prior), expected_information(at)
    return at, information, expected_sd(precision, information, log_gradient(recorded.model, phi))


@dataclass(frozen=True)
class CohortIdentifiability:
    """Every subject's identifiability, and phases chosen for all; in the order of ``recorded``."""

    recorded: tuple[RecordedSubject, ...]
    subjects: tuple[SubjectIdentifiability, ...]
    placement: Placement


def identify_cohort(
    recorded: Sequence[RecordedSubject], settings: IdentifiabilitySettings, seed: int
) -> CohortIdentifiability:
    """Study every subject, and choose phases for the cohort.

    Raises:
        ValueError: There is no subject.
    """
    if not recorded:
        raise ValueError("no subject: the cohort is empty")
    progress = Progress("identifiability", len(recorded), "subject")
    subjects = []
    for subject in recorded:
        subjects.append(identify(subject, settings, seed))
        progress.step(note=subject.name)
    draws = settings.design.placement_draws
    placement = place_phases(
        [subject.model for subject in recorded],
        [stencil_of(subject, draws, settings, seed) for subject in recorded],
        [subject.repeat.of(subject.equivalent_repeats) for subject in recorded],
        settings.design,
    )
    return CohortIdentifiability(tuple(recorded), tuple(subjects), placement)
