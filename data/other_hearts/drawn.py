"""Hearts that the model's own simulator does not make: drawn one by one, and stored."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Protocol

import numpy as np

from studies.validation.hearts.beat import Beat
from studies.validation.hearts.stored import StoredHeart, Stream
from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.measurement.operator import passive_shape
from swesbi.population.contexts import draw_one
from swesbi.population.settings import PopulationSettings
from swesbi.seeds import generator
from swesbi.virtual.generated import PHYSIOLOGY
from swesbi.virtual.volunteers import designed_scale, with_own_lvesv

LOGGER = logging.getLogger("swesbi")
MAX_ATTEMPTS: Final = 100
PASSIVE: Final = ("late_diastolic_kpa", "passive_exponent_b")
FAILED, IMPLAUSIBLE, STIFF = "failed", "implausible", "stiff"


@dataclass(frozen=True)
class Drawn:
    """What one heart has of its own.

    ``theta`` is in the order of ``THETA_NAMES``, NaN where its law has others; ``own`` is named with units.
    """

    theta: FloatArray
    own: Mapping[str, float]


class Source(Protocol):
    """Where hearts of one letter come from."""

    @property
    def letter(self) -> str:
        """Its letter."""

    @property
    def settings(self) -> dict[str, Any]:
        """What a heart depends on besides its draws and the population, as plain data."""

    def draw(self, context: Context, rng: np.random.Generator) -> Drawn:
        """Draw what a heart in this context has of its own."""

    def beat(self, context: Context, drawn: Drawn) -> Beat:
        """Return its periodic beat; a RuntimeError where it has none."""

    def refusal(self, beat: Beat) -> str:
        """Say why a beat is no person's, or nothing where it may be."""


@dataclass(frozen=True)
class People:
    """Whose hearts they are, and how they are measured.

    ``lvesv_fraction`` is the standard deviation of the logarithm of a measured LVESV.
    """

    population: PopulationSettings
    lvesv_fraction: float


def draw_heart(source: Source, stream: Stream, number: int, people: People, seed: int) -> StoredHeart:
    """Draw one heart, all of it from ``generator(seed, stream, letter, number)``.

    What has no periodic beat, no person's beat, or is stiffer by its active part alone in late diastole than
    it is designed to be in all, is counted and drawn again, context included, from the same stream. The error
    of the listed LVESV is drawn last. Many draws without a heart are a RuntimeError.
    """
    rng = generator(seed, stream, source.letter, number)
    refused: Counter[str] = Counter()
    for _ in range(MAX_ATTEMPTS):
        context = draw_one(number, people.population, rng).context
        drawn = source.draw(context, rng)
        designed_kpa, exponent_b = (float(rng.uniform(*PHYSIOLOGY[name])) for name in PASSIVE)
        beat = _beat(source, context, drawn)
        if isinstance(beat, str):
            refused[beat] += 1
            continue
        scale = designed_scale(
            designed_kpa, beat.phase, beat.active_kpa, passive_shape(beat.stretch, exponent_b)
        )
        if scale <= 0.0:
            refused[STIFF] += 1
            continue
        measured = _measured(context, beat, people.lvesv_fraction, rng)
        if measured is None:
            refused[IMPLAUSIBLE] += 1
            continue
        return StoredHeart(
            context=measured,
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


def _measured(
    context: Context, beat: Beat, lvesv_fraction: float, rng: np.random.Generator
) -> Context | None:
    """Return the context with the LVESV of this beat; none where ingestion would admit no such heart."""
    try:
        return with_own_lvesv(context, beat.volume_ratio, lvesv_fraction, rng)
    except RuntimeError as error:
        LOGGER.info("drawn again: %s", error)
        return None
