"""Raw recordings of a cohort become observed curves, and their repeats its noise."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import NamedTuple

from swesbi.artefacts import UnfitError
from swesbi.recording.cohort.clinical import ClinicalRow
from swesbi.recording.cohort.recording_file import read_recording_file
from swesbi.recording.ingest import ingest
from swesbi.recording.noise.cohort import CohortNoise, GroupNoise, fit_cohort
from swesbi.recording.noise.components import RepeatLevels
from swesbi.recording.noise.sweeps import levels_by
from swesbi.recording.observation import Contexts, Observation
from swesbi.recording.quality import phases_left_out, rejection
from swesbi.recording.reader import read_samples
from swesbi.recording.samples import ACCEPTED
from swesbi.recording.settings import ContextRow, NoiseSettings, RecordingSettings, Repeats
from swesbi.recording.tables.layout import TableLayout

LOGGER = logging.getLogger("swesbi")


def observed_curve(
    table: Path,
    *,
    context: ContextRow,
    clinical_row: ClinicalRow,
    recording: RecordingSettings,
    grid_points: int,
    layout: TableLayout,
) -> Observation:
    """Read a subject's recording: quality control, mean speed at each phase, E = 3 rho c^2."""
    samples = read_samples(table, recording.phases, recording.density_kg_m3, layout, context.subject)
    observed = ingest(samples, context.to_context(), recording, grid_points, clinical_row.to_measures())
    LOGGER.info("%s", _account(observed))
    for sentence in phases_left_out(samples, recording):
        LOGGER.warning("subject %s: %s", context.subject, sentence)
    return observed


def _account(observed: Observation) -> str:
    rejected = ", ".join(f"{reason} {count}" for reason, count in observed.rejected.items() if count)
    return (
        f"subject {observed.subject}: {int(observed.measured.sum())} of {len(observed.phase)} phases, "
        f"{int(observed.samples_accepted.sum())} samples accepted; rejected: {rejected or 'none'}; "
        f"noise {observed.noise.repeat_fraction:.1%} between repeats, "
        f"{observed.noise.sample_fraction:.1%} between samples"
    )


class OfCohort(NamedTuple):
    """What the recordings of a cohort have in common: the noise of their speeds, and the contexts."""

    noise: CohortNoise
    contexts: Contexts


def cohort_noise(
    tables: tuple[Path, ...],
    observations: tuple[Observation, ...],
    protocol: Path,
    *,
    recording: RecordingSettings,
    layout: TableLayout,
    noise: NoiseSettings,
    noise_groups: dict[str, str],
) -> OfCohort:
    """Fit the mixed model to the accepted samples of all recordings, and put the contexts together.

    Raw ``tables`` are in the order of their observed curves, which name the subjects; ``noise_groups`` has
    the group of each subject whose errors are estimated apart. ``protocol`` is the cohort's
    ``recording.yaml``, which says whether repeats are sweeps.

    Raises:
        ArtefactError: An observed curve was not made of its recording under these settings.
        ValueError: A component cannot be estimated from the recordings.
    """
    repeats = read_recording_file(protocol.parent).protocol.repeats_are
    levels = {
        observed.subject: _levels(table, observed, repeats, recording, layout)
        for table, observed in zip(tables, observations, strict=True)
    }
    fitted = fit_cohort(levels, noise_groups, noise.interval)
    for name, group in fitted.groups.items():
        LOGGER.info("%s", _account_of_noise(name, group))
    return OfCohort(fitted, Contexts(tuple(observed.context for observed in observations)))


def _levels(
    table: Path, observed: Observation, repeats: Repeats, recording: RecordingSettings, layout: TableLayout
) -> RepeatLevels:
    samples = read_samples(table, recording.phases, recording.density_kg_m3, layout, observed.subject)
    accepted = rejection(samples, recording) == ACCEPTED
    if int(accepted.sum()) != int(observed.samples_accepted.sum()):
        raise UnfitError(
            "tables",
            f"{int(accepted.sum())} samples of {table} are accepted, but the observed curve of subject "
            f"{observed.subject} has {int(observed.samples_accepted.sum())}; delete the curve and rerun",
        )
    return levels_by(repeats, samples, accepted)


def _account_of_noise(name: str, noise: GroupNoise) -> str:
    parts = [
        f"{part.fraction:.2%} between {of}s ({part.low:.2%} to {part.high:.2%})"
        for of, part in noise.pooled.parts.items()
    ]
    return (
        f"noise of {len(noise.by_subject)} recordings ({name}): {', '.join(parts)}; the same in all: p = "
        f"{noise.homogeneity_p:.2g}"
    )
