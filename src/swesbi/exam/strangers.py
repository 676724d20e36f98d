"""Hearts that sit the exam and that the model's own simulator does not make: drawn one by one, and stored."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final, Protocol

import numpy as np

from swesbi.arrays import FloatArray
from swesbi.checks.discrepancy.cohort import PHYSIOLOGY
from swesbi.context import Context
from swesbi.exam.beat import Beat
from swesbi.exam.stored import StoredHeart, Stream
from swesbi.measurement.operator import passive_shape
from swesbi.population.contexts import draw_one
from swesbi.population.settings import PopulationSettings
from swesbi.seeds import generator
from swesbi.virtual_cohort.volunteers import designed_scale

LOGGER = logging.getLogger("swesbi")
MAX_ATTEMPTS: Final = 100
PASSIVE: Final = ("late_diastolic_kpa", "passive_exponent_b")
FAILED, IMPLAUSIBLE, STIFF = "failed", "implausible", "stiff"


@dataclass(frozen=True)
class Drawn:
    """What one heart has of its own.

    Attributes:
        theta: True parameters in the order of ``THETA_NAMES``, shape (3,); NaN where its law has others.
        own: Its other parameters, by their names, which end in the unit.
    """

    theta: FloatArray
    own: Mapping[str, float]


class Source(Protocol):
    """Where hearts of one letter come from."""

    @property
    def letter(self) -> str:
        """Its letter in docs/exam.md."""

    @property
    def settings(self) -> dict[str, Any]:
        """What a heart depends on besides its draws and the population, as plain data."""

    def draw(self, context: Context, rng: np.random.Generator) -> Drawn:
        """Draw what a heart in this context has of its own."""

    def beat(self, context: Context, drawn: Drawn) -> Beat:
        """Return its periodic beat.

        Raises:
            RuntimeError: It has none.
        """

    def refusal(self, beat: Beat) -> str:
        """Say why a beat is no person's, or nothing where it may be."""


def draw_hearts(
    source: Source, stream: Stream, count: int, population: PopulationSettings, seed: int
) -> Iterator[StoredHeart]:
    """Draw the hearts number 0 to ``count - 1`` of a stream; see :func:`draw_heart`."""
    for number in range(count):
        heart = draw_heart(source, stream, number, population, seed)
        LOGGER.info(
            "%s: ejection fraction %.2f, attains %.1f kPa",
            heart.context.subject,
            heart.beat.ejection_fraction,
            heart.beat.active_kpa.max(),
        )
        yield heart


def draw_heart(
    source: Source, stream: Stream, number: int, population: PopulationSettings, seed: int
) -> StoredHeart:
    """Draw one heart, all of it from ``generator(seed, stream, letter, number)``.

    What has no periodic beat, no person's beat, or is stiffer by its active part alone in late diastole than
    it is designed to be in all, is counted and drawn again, context included, from the same stream.

    Raises:
        RuntimeError: No heart came of many draws.
    """
    rng = generator(seed, stream, source.letter, number)
    refused: Counter[str] = Counter()
    for _ in range(MAX_ATTEMPTS):
        context = draw_one(number, population, rng).context
        drawn = source.draw(context, rng)
        designed_kpa, exponent_b = (float(rng.uniform(*PHYSIOLOGY[name])) for name in PASSIVE)
        beat = _beat(source, context, drawn)
        if isinstance(beat, str):
            refused[beat] += 1
            continue
        scale = designed_scale(
            designed_kpa, beat.phase, beat.active_kpa, passive_shape(beat.stretch, exponent_b)
        )
        if scale > 0.0:
            return StoredHeart(
                context=context,
                stream=stream,
                number=number,
                theta=drawn.theta,
                own_names=tuple(drawn.own),
                own=np.array(list(drawn.own.values())),
                late_diastolic_kpa=designed_kpa,
                passive_exponent_b=exponent_b,
                passive_scale_kpa=scale,
                beat=beat,
                refused_failed=refused[FAILED],
                refused_implausible=refused[IMPLAUSIBLE],
                refused_stiff=refused[STIFF],
            )
        refused[STIFF] += 1
    raise RuntimeError(f"{source.letter}: no heart number {number} in {MAX_ATTEMPTS} draws: {dict(refused)}")


def _beat(source: Source, context: Context, drawn: Drawn) -> Beat | str:
    """Return the beat, or which kind of refusal it meets."""
    try:
        beat = source.beat(context, drawn)
    except RuntimeError as error:
        LOGGER.info("%s drawn again: %s", context.subject, error)
        return FAILED
    if refusal := source.refusal(beat):
        LOGGER.info("%s drawn again: %s", context.subject, refusal)
        return IMPLAUSIBLE
    return beat
