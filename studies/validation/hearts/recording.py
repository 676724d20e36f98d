"""A heart as inference sees it: recorded sample by sample at its generator's noise, ingested."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from typing import Final

from studies.validation.hearts.generators import Generator
from studies.validation.hearts.heart import OtherHeart
from swesbi.recording.acquisition import acquire
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import Observation
from swesbi.recording.problems import RecordingError
from swesbi.recording.samples import Samples
from swesbi.recording.settings import RecordingSettings
from swesbi.seeds import generator as stream_of

LOGGER = logging.getLogger("swesbi")
VALIDATION_STREAM: Final = "exam"
"""Name of the random streams of the hearts of the validation; another name gives other hearts."""
DEVELOPMENT: Final = ("p",)
"""Letters of the hearts that are in no validation."""
MAX_ATTEMPTS: Final = 20


@dataclass(frozen=True)
class RecordedHeart:
    """One heart with its raw recording and what ingestion makes of it.

    ``redrawn`` counts hearts and recordings that were drawn before it, and failed.
    """

    heart: OtherHeart
    samples: Samples
    observation: Observation
    redrawn: int


def record_heart(
    generator: Generator,
    index: int,
    seed: int,
    name: str,
    recording: RecordingSettings,
    grid_points: int,
) -> RecordedHeart:
    """Draw the heart of this number from the stream of this name, and record it.

    A heart without a periodic beat, and a recording that ingestion refuses, are drawn again, from the same
    stream where it stands; after many attempts that is a RuntimeError.
    """
    rng, subject = stream_of(seed, name, generator.letter, index), subject_name(generator.letter, index, name)
    for attempt in range(MAX_ATTEMPTS):
        try:
            drawn = generator.draw(index, rng)
            heart = replace(drawn, context=replace(drawn.context, subject=subject))
            samples = acquire(heart.curve, heart.context, generator.acquisition, rng)
            observation = ingest(samples, heart.context, recording, grid_points)
        except (RuntimeError, RecordingError) as error:
            LOGGER.info("heart %s drawn again: %s", subject, error)
        else:
            return RecordedHeart(heart, samples, observation, attempt)
    raise RuntimeError(f"heart {subject}: no usable recording in {MAX_ATTEMPTS} attempts")


def subject_name(letter: str, index: int, name: str) -> str:
    """Return what a heart is called: by letter and number, its stream before them if of no validation."""
    number = f"{letter}{index + 1:03d}"
    return number if name == VALIDATION_STREAM else f"{name}-{number}"
