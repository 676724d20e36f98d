"""Recordings of one heart under several names, as a cohort's artefacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import speed_case
from recordings import RECORDING, make_samples

from swesbi.artefacts import Provenance
from swesbi.recording.ingest import ingest
from swesbi.recording.noise.cohort import fit_cohort
from swesbi.recording.noise.components import RepeatLevels
from swesbi.recording.quality import rejection
from swesbi.recording.samples import ACCEPTED


def write_observed_cohort(folder: Path, subjects: Sequence[str]) -> None:
    """Write ``<subject>.h5`` of each subject, recorded with noise of its own, and ``noise.h5``."""
    speeds = speed_case.model().recording.speed_m_s
    levels = {}
    for seed, subject in enumerate(subjects):
        samples = make_samples(speeds, repeat_sd=0.04, sample_sd=0.08, seed=seed)
        context = replace(speed_case.CONTEXT, subject=subject)
        observed = ingest(samples, context, RECORDING, 100)
        observed.write(folder / f"{subject}.h5", Provenance("", subject, 1, {}, "c"))
        levels[subject] = RepeatLevels.of(samples, rejection(samples, RECORDING) == ACCEPTED)
    fit_cohort(levels, {}).write(folder / "noise.h5", Provenance("", "", 1, {}, "c"))
