"""A page of the explorer with two shipped recordings and draws of the prior in place of posteriors."""

from __future__ import annotations

from functools import cache

import numpy as np
import speed_case
from posterior_case import exact_of
from study_copy import ROOT

from explorer.data import ExploredSubject, page_data
from explorer.page import render_page
from explorer.physics import physics
from swesbi.prior import sample
from swesbi.recording.cohort.files import find_recording
from swesbi.recording.cohort.subjects import read_subject_table
from swesbi.recording.ingest import ingest
from swesbi.recording.noise.cohort import CohortNoise, GroupNoise, NoiseEstimate
from swesbi.recording.noise.components import ComponentEstimate
from swesbi.recording.observation import Observation
from swesbi.recording.reader import read_samples
from swesbi.recording.speed import NoiseComponents
from swesbi.verdict.verdict import Verdict

COHORT = ROOT / "data" / "virtual_volunteers"
NOISE = NoiseComponents(0.03, 0.06, 0.015)
PARTS = [ComponentEstimate(size, 0.001, size, size) for size in (0.03, 0.06, 0.015)]
ALONE = NoiseEstimate(PARTS[0], PARTS[1], 60, 700, PARTS[2])
COHORT_NOISE = CohortNoise({"others": GroupNoise(ALONE, dict.fromkeys("AB", ALONE), 0.5)}, 0.9)
WORDS = {
    "title": "virtual volunteers",
    "cohort_title": "virtual volunteers",
    "experiment": "calibrated",
    "origin": "a test",
}


@cache
def observation(subject: str) -> Observation:
    """Return a shipped recording, ingested."""
    settings = speed_case.shipped().recording
    context = read_subject_table(COHORT / "subjects.csv").rows[subject].to_context()
    samples = read_samples(find_recording(COHORT, subject), settings.phases, settings.density_kg_m3)
    return ingest(samples, context, settings, speed_case.shipped().measurement.grid_points)


@cache
def explored(subject: str) -> ExploredSubject:
    """Return a subject whose posterior is its prior, narrowed to the middle half."""
    prior = speed_case.settings("calibrated").prior
    phi = sample(300, prior, np.random.default_rng(7))
    result = exact_of(phi)
    sentence = f"{subject} is not contradicted: no test speaks against it."
    verdict = Verdict(0.0, "", 1, 1, {}, "not contradicted", sentence, ())
    return ExploredSubject(observation(subject), result, verdict)


@cache
def page() -> str:
    """Return the page."""
    settings = speed_case.settings("calibrated")
    data = page_data(
        [explored("A"), explored("B")], COHORT_NOISE, settings, speed_case.shipped().recording, 1
    )
    return render_page(WORDS, data, physics(settings, speed_case.exact(), speed_case.rule()))
