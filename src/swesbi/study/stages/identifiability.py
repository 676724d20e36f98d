"""What the recordings can tell about the parameters, and what other recordings would; its figures."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from swesbi.artefacts import ArtefactError, Origin, load, save
from swesbi.artefacts.csv import write_csv
from swesbi.base.settings import Settings
from swesbi.checks.identifiability import tables
from swesbi.checks.identifiability.information import QUANTITY_NAMES
from swesbi.checks.identifiability.noise import single_repeat_noise
from swesbi.checks.identifiability.settings import IdentifiabilitySettings
from swesbi.checks.identifiability.subject import CohortIdentifiability, RecordedSubject, identify_cohort
from swesbi.measurement.likelihood import SpeedModelSettings, read_speed_model
from swesbi.posterior.result import read_exact_posterior
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.report.figures.identifiability import draw_identifiability
from swesbi.report.figures.style import save_figure
from swesbi.study.stages.origin import result_key

LOGGER = logging.getLogger("swesbi")


class IdentifiabilityStageSettings(Settings):
    """What the study of identifiability depends on."""

    model: SpeedModelSettings
    identifiability: IdentifiabilitySettings


def identifiability(
    *,
    posteriors: Sequence[Path],
    observations: Sequence[Path],
    noise: Path,
    identifiability: Path,
    summary: Path,
    information: Path,
    design: Path,
    settings: IdentifiabilityStageSettings,
    origin: Origin,
) -> None:
    """Study every subject of the cohort; write the artefact and its three tables.

    Raises:
        ArtefactError: A posterior is missing, empty or of another subject than its recording.
        ValueError: A reference beat does not become periodic, or there is no subject.
    """
    pairs = zip(posteriors, observations, strict=True)
    recorded = [
        read_recorded(posterior, observation, noise, settings.model) for posterior, observation in pairs
    ]
    cohort = identify_cohort(recorded, settings.identifiability, origin.seed)
    groups = tables.to_groups(cohort, settings.identifiability)
    save(identifiability, groups, origin.provenance(tables.KIND, settings))
    write_csv(summary, tables.summary_table(groups["/"], groups["profile"]))
    write_csv(information, tables.information_table(groups["phases"]))
    mass = settings.identifiability.interval
    write_csv(design, tables.design_table(groups["design"], groups["placement"], mass))
    _log(cohort)


def read_recorded(
    posterior: Path, observation: Path, noise: Path, settings: SpeedModelSettings
) -> RecordedSubject:
    """Read one recording with its posterior draws.

    Raises:
        ArtefactError: The posterior is empty, or of another subject.
    """
    observed = Observation.read(observation)
    components = CohortNoise.read(noise).of(observed.subject)
    phi = read_exact_posterior(posterior).phi
    if result_key(posterior).subject != observed.subject:
        raise ArtefactError(
            f"{posterior}: is not of subject {observed.subject}, whose recording comes with it"
        )
    if not len(phi):
        raise ArtefactError(f"{posterior}: holds no posterior draw; delete it and rerun")
    return RecordedSubject(
        model=read_speed_model(observation, noise, settings),
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


class IdentifiabilityFiguresSettings(Settings):
    """What the figures call the subjects."""

    cohort_title: str


def identifiability_figures(
    *,
    identifiability: Path,
    identifiability_pdf: Path,
    identifiability_png: Path,
    settings: IdentifiabilityFiguresSettings,
    origin: Origin,
) -> None:
    """Draw what the recordings tell.

    Raises:
        ArtefactError: The file is not such an artefact.
    """
    groups = {name: load(identifiability, tables.KIND, name)[0] for name in tables.SCHEMA}
    save_figure(draw_identifiability(groups, settings.cohort_title), identifiability_pdf, identifiability_png)
