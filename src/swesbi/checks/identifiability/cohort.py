"""What the recordings of a cohort can tell about the parameters, and what other recordings would."""

from __future__ import annotations

import logging
from typing import NamedTuple

import numpy as np

from swesbi.artefacts import UnfitError
from swesbi.artefacts.csv import PlainTable
from swesbi.artefacts.typed import BySubject
from swesbi.checks.identifiability.information import QUANTITY_NAMES
from swesbi.checks.identifiability.noise import single_repeat_noise
from swesbi.checks.identifiability.settings import IdentifiabilitySettings
from swesbi.checks.identifiability.subject import CohortIdentifiability, RecordedSubject, identify_cohort
from swesbi.checks.identifiability.tables import (
    Identifiability,
    design_table,
    information_table,
    summary_table,
)
from swesbi.measurement.likelihood import SpeedModelSettings, speed_model
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation

LOGGER = logging.getLogger("swesbi")


class OfCohort(NamedTuple):
    """The study of identifiability, and its tables."""

    identifiability: Identifiability
    summary: PlainTable
    information: PlainTable
    design: PlainTable


def identifiability_of_cohort(
    posteriors: BySubject[ExactPosterior],
    observations: tuple[Observation, ...],
    noise: CohortNoise,
    *,
    model: SpeedModelSettings,
    identifiability: IdentifiabilitySettings,
    seed: int,
) -> OfCohort:
    """Study every subject of the cohort.

    Raises:
        ArtefactError: A posterior is missing or empty.
        ValueError: A reference beat does not become periodic, or there is no subject.
    """
    recorded = [recorded_subject(posteriors, observed, noise, model) for observed in observations]
    cohort = identify_cohort(recorded, identifiability, seed)
    found = Identifiability.of(cohort, identifiability)
    groups = found.datasets
    _log(cohort)
    return OfCohort(
        identifiability=found,
        summary=summary_table(groups["/"], groups["profile"]),
        information=information_table(groups["phases"]),
        design=design_table(groups["design"], groups["placement"], identifiability.interval),
    )


def recorded_subject(
    posteriors: BySubject[ExactPosterior],
    observed: Observation,
    noise: CohortNoise,
    model: SpeedModelSettings,
) -> RecordedSubject:
    """Return a recording with its posterior draws.

    Raises:
        ArtefactError: The posterior is missing or empty.
    """
    phi, components = posteriors[observed.subject].phi, noise.of(observed.subject)
    if not len(phi):
        fault = f"that of {observed.subject} holds no posterior draw; delete it and rerun"
        raise UnfitError("posteriors", fault)
    return RecordedSubject(
        model=speed_model(observed, noise, model),
        phi=phi,
        phase=observed.phase,
        measured=observed.measured,
        repeat=single_repeat_noise(components, observed.samples_by_repeat[observed.measured]),
    )


def _log(cohort: CohortIdentifiability) -> None:
    """Log the expected over the found posterior sd: how far the design figures can be trusted."""
    for subject in cohort.subjects:
        ratio = subject.spread.expected_sd_log / subject.spread.sd_log
        parts = ", ".join(
            f"{name} {value:.2f}" for name, value in zip(QUANTITY_NAMES, np.round(ratio, 2), strict=True)
        )
        LOGGER.info("subject %s: expected / found posterior sd: %s", subject.subject, parts)
