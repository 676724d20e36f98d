"""Hearts that are stored: read from their artefact, and as the hearts of a generator."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Final, Literal

import numpy as np

from studies.validation.hearts.beat import Beat
from studies.validation.hearts.heart import K_SR, OtherHeart
from swesbi.artefacts import (
    Artefact,
    ArtefactError,
    Group,
    Labels,
    Part,
    Provenance,
    Variable,
    build_group,
    from_rows,
    schema_of,
    stacked_values,
)
from swesbi.artefacts.schema import Schema
from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.measurement.operator import passive_shape
from swesbi.parameters import THETA_COLUMNS, THETA_NAMES
from swesbi.recording.acquisition import TruthCurve
from swesbi.recording.settings import AcquisitionSettings
from swesbi.seeds import seed_sequence

Stream = Literal["exam", "development", "filling"]
ALONG: Final = "heart"
COUNT: Final = "draws refused before this one: "
FILES: Final = {
    "e": ("physioblocks.h5", "PhysioBlocks 2.0.1"),
    "f": ("land2017.h5", "cross-bridges of Land et al. 2017"),
    "p": ("emulated.h5", "PhysioBlocks by this project's loop"),
}
"""File and title of each stored letter; that of p is made when it is asked for (README.md beside it)."""
FAR: Final = 1 << 96
"""Steps of a random stream, beyond whatever the drawing of a heart may have taken of it."""


@dataclass(frozen=True)
class StoredHeart:
    """One heart with its periodic beat, and how it came about.

    The total stiffness is a exp(b (lambda^2 - 1)) plus the active stiffness of the beat.
    """

    context: Annotated[Context, Part()]
    stream: Annotated[Stream, Variable("", "1", "name of the stream that it is drawn from")]
    number: Annotated[int, Variable("", "1", "its number in the stream")]
    theta: Annotated[
        FloatArray, Variable("parameter", THETA_COLUMNS, "true parameters; NaN where its law has others")
    ]
    own_names: Annotated[tuple[str, ...], Labels("own_parameter")]
    own: Annotated[
        FloatArray,
        Variable("own_parameter", "1", "its other parameters, in the unit that the name ends with"),
    ]
    late_diastolic_kpa: Annotated[float, Variable("", "kPa", "designed mean stiffness in late diastole")]
    passive_exponent_b: Annotated[float, Variable("", "1", "exponent b of the passive stiffness")]
    passive_scale_kpa: Annotated[float, Variable("", "kPa", "scale a of the passive stiffness")]
    beat: Annotated[Beat, Part()]
    refused_failed: Annotated[int, Variable("", "1", f"{COUNT}no periodic beat")]
    refused_implausible: Annotated[int, Variable("", "1", f"{COUNT}the beat is no person's")]
    refused_stiff: Annotated[int, Variable("", "1", f"{COUNT}too much active stiffness in late diastole")]

    def other_heart(self) -> OtherHeart:
        """Return it as a heart of a generator."""
        beat, own_law = self.beat, bool(np.isfinite(self.theta).all())
        passive = self.passive_scale_kpa * passive_shape(beat.stretch, self.passive_exponent_b)
        return OtherHeart(
            context=self.context,
            curve=TruthCurve(beat.phase, passive + beat.active_kpa),
            theta=self.theta if own_law else None,
            k_sr_per_s=float(self.theta[K_SR]) if own_law else None,
            active_kpa=beat.active_kpa,
            isometric_kpa=None,
            volume_ratio=beat.volume_ratio,
        )


SCHEMA: Final = schema_of(StoredHeart, ALONG)["/"]


@dataclass(frozen=True)
class HeartsOfLetter(Artefact, kind="validation_hearts"):
    """At least one heart of a letter, of all streams, as drawn; all have the same other parameters."""

    hearts: Sequence[StoredHeart]
    made: Provenance

    @classmethod
    def schema(cls) -> Schema:
        """Return the one group of the file."""
        return {"/": SCHEMA}

    @classmethod
    def required_labels(cls) -> tuple[Labels, ...]:
        """Return the names of the parameters and of the hearts."""
        return (Labels("parameter"), Labels("own_parameter"), Labels(ALONG, "subject"))

    def to_groups(self) -> dict[str, Group]:
        """Return the content; curves in single precision, which is far finer than any recording."""
        values = stacked_values(self.hearts)["/"]
        single = {
            name: value.astype(np.float32) for name, value in values.items() if "cycle" in SCHEMA[name].dims
        }
        labels = {
            "subject": (ALONG, [heart.context.subject for heart in self.hearts]),
            "parameter": list(THETA_NAMES),
            "own_parameter": list(self.hearts[0].own_names),
            "cycle": self.hearts[0].beat.phase,
        }
        return {"/": build_group(SCHEMA, values | single, labels)}

    @classmethod
    def rebuilt(cls, groups: Mapping[str, Group], made: Provenance) -> HeartsOfLetter:
        """Return what the group of a file holds, and where it comes from."""
        subjects = [str(name) for name in groups["/"]["subject"].to_numpy()]
        rows = from_rows(StoredHeart, _in_double(groups["/"]), ALONG, **{"context.subject": subjects})
        return cls(rows, made)


def _in_double(group: Group) -> Group:
    """Return the group with its curves in double precision."""
    curves = {
        name: replace(array, values=array.values.astype(np.float64))
        for name, array in group.items()
        if "cycle" in array.dims and name not in group.labels
    }
    return replace(group, arrays={**group.arrays, **curves})


StreamKey = tuple[object, tuple[int, ...]]
"""What a random stream is known by: the seed and the spawn key of its names."""


@dataclass(frozen=True)
class StoredHearts:
    """The stored hearts of one letter as a generator."""

    letter: str
    title: str
    acquisition: AcquisitionSettings
    path: Path

    def draw(self, index: int, rng: np.random.Generator) -> OtherHeart:
        """Return the heart that was drawn from this stream, and lead the stream beyond what it took."""
        hearts, sequence = _by_stream(self.path, self.letter), rng.bit_generator.seed_seq
        known = _key(sequence) if isinstance(sequence, np.random.SeedSequence) else None
        if known not in hearts or not isinstance(rng.bit_generator, np.random.PCG64):
            raise ValueError(
                f"{self.path}: no heart number {index} of this stream is stored; there are "
                f"{_there(self.path)}; ask for fewer, or store more: data/other_hearts/README.md"
            )
        rng.bit_generator.advance(FAR)
        return hearts[known]


def stored_generators(folder: Path, acquisition: AcquisitionSettings) -> dict[str, StoredHearts]:
    """Return the generators that a folder stores, by letter; files are read when a heart is asked for."""
    return {
        letter: StoredHearts(letter, title, acquisition, folder / name)
        for letter, (name, title) in FILES.items()
    }


@lru_cache(maxsize=4)
def _by_stream(path: Path, letter: str) -> Mapping[StreamKey | None, OtherHeart]:
    if not path.is_file():
        raise ArtefactError(
            f"{path}: no such file; make it: .venv/bin/python data/other_hearts/make.py {letter} {path}"
        )
    stored = HeartsOfLetter.read(path)
    if (there := stored.made.settings.get("letter")) != letter:
        raise ValueError(f"{path}: holds hearts of {there!r}, not of {letter!r}")
    return {
        _key(seed_sequence(stored.made.seed, heart.stream, letter, heart.number)): heart.other_heart()
        for heart in stored.hearts
    }


def _key(sequence: np.random.SeedSequence) -> StreamKey:
    return sequence.entropy, tuple(sequence.spawn_key)


def _there(path: Path) -> str:
    """Say which hearts a file holds."""
    stored = HeartsOfLetter.read(path)
    counts = Counter(heart.stream for heart in stored.hearts)
    streams = ", ".join(f"{count} of {stream!r}" for stream, count in counts.items())
    return f"{streams}, of seed {stored.made.seed}"
