"""The stage that estimates the noise of a cohort, by the model that the cohort says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recordings import CONTEXT, RECORDING, make_samples

from data.makers.files import samples_table
from swesbi.artefacts import ArtefactError, Provenance
from swesbi.recording.cohort.observed import OfCohort, cohort_noise
from swesbi.recording.ingest import ingest
from swesbi.recording.noise.cohort import CohortNoise, fit_noise
from swesbi.recording.noise.sweeps import levels_by
from swesbi.recording.observation import Contexts
from swesbi.recording.quality import rejection
from swesbi.recording.samples import ACCEPTED, Samples
from swesbi.recording.settings import OTHERS, NoiseSettings, Repeats
from swesbi.recording.tables.layout import TableLayout

SETTINGS: dict[str, Any] = {
    "recording": RECORDING,
    "noise": NoiseSettings(interval=0.9),
    "layout": TableLayout(),
    "noise_groups": {},
}
SWEEPS = np.array([0.95, 1.0, 1.05])
"""What the speeds of each sweep are multiplied by."""


def recording(seed: int) -> Samples:
    made = make_samples(repeat_sd=0.04, sample_sd=0.08, seed=seed)
    return replace(made, speed_m_s=made.speed_m_s * SWEEPS[made.repeat])


RECORDINGS = {name: recording(seed) for seed, name in enumerate("PQ")}


def inputs(folder: Path, protocol: str) -> dict[str, Any]:
    """Recordings of P and Q with their curves, and what the cohort says of them."""
    folder.mkdir(exist_ok=True)
    tables = tuple(folder / f"{name}.csv" for name in "PQ")
    for samples, table in zip(RECORDINGS.values(), tables, strict=True):
        samples_table(samples).to_csv(table, index=False)
    (folder / "recording.yaml").write_text(protocol)
    observations = tuple(
        ingest(samples, replace(CONTEXT, subject=name), RECORDING, 100)
        for name, samples in RECORDINGS.items()
    )
    return {"tables": tables, "observations": observations, "protocol": folder / "recording.yaml"}


def run_stage(folder: Path, protocol: str) -> OfCohort:
    return cohort_noise(**inputs(folder, protocol), **SETTINGS)


@pytest.mark.parametrize("repeats", ["separate", "sweeps"])
def test_the_stage_writes_what_the_fit_found_by_the_model_that_the_cohort_says(
    tmp_path: Path, repeats: Repeats
) -> None:
    made = run_stage(tmp_path, f"origin: a\nprotocol: {{repeats_are: {repeats}}}\n")
    accepted = {name: rejection(samples, RECORDING) == ACCEPTED for name, samples in RECORDINGS.items()}
    expected = fit_noise(
        {name: levels_by(repeats, samples, accepted[name]) for name, samples in RECORDINGS.items()}
    )
    made.noise.write(written := tmp_path / "noise.h5", Provenance(""))
    found = CohortNoise.read(written)
    assert found == CohortNoise({OTHERS: expected}, 0.9)
    assert found.group_of == {"P": OTHERS, "Q": OTHERS}
    assert found.of("Q") == found.usual == expected.pooled.components
    assert (expected.pooled.sweep is None) == (repeats == "separate")
    parts = ["repeat", "sample", *(["sweep"] if repeats == "sweeps" else [])]
    assert CohortNoise.load(written)[0]["/"]["component"].to_numpy().tolist() == parts
    with pytest.raises(ArtefactError, match="the noise of R is not known; it is of P, Q"):
        found.of("R")
    made.contexts.write(tmp_path / "contexts.h5", Provenance(""))
    contexts = tuple(replace(CONTEXT, subject=name) for name in "PQ")
    assert Contexts.read(tmp_path / "contexts.h5") == made.contexts == Contexts(contexts)


def test_separate_is_what_a_cohort_means_that_says_nothing(tmp_path: Path) -> None:
    said = run_stage(tmp_path / "said", "origin: a\nprotocol: {repeats_are: separate}\n")
    for number, unsaid in enumerate(("", "protocol:\n  repeats_are:\n")):
        other = run_stage(tmp_path / str(number), f"origin: a\n{unsaid}")
        assert other == said


def test_curves_of_other_recordings_are_refused(tmp_path: Path) -> None:
    given = inputs(tmp_path, "origin: a test\n")
    given["tables"] = given["tables"][::-1]
    with pytest.raises(ArtefactError, match=r"Q\.csv.*subject P"):
        cohort_noise(**given, **SETTINGS)
