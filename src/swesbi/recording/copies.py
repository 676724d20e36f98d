"""Measurements that stand twice: a beat, a repeat, a whole recording, with the same speeds to the last digit.

Speeds of finite resolution are equal by chance now and then. So a copy is a row of equal speeds that the
resolution of the recording, and the number of rows that are compared, leave no chance for.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray, IntArray
from swesbi.recording.problems import Problem, raise_any
from swesbi.recording.samples import Samples
from swesbi.recording.tables.layout import SPEED

MOST_BY_CHANCE: Final = 1.0e-3
"""Equal rows that chance makes in a recording, above which they are none."""
LEAST: Final = 4
"""Speeds of a row that is compared."""
REMEDY: Final = (
    "remove the copy; if both are meant, say `table: { copies_allowed: true }` in recording.yaml or "
    "swe/<subject>.yaml"
)
Block = tuple[float | None, ...]
"""The speeds of one beat or repeat in their order, None where there is none."""


def check_copies(samples: Samples) -> None:
    """Refuse a recording in which a repeat of a gate, or a numbered beat, stands twice."""
    beats = samples.beats
    if samples.gate is not None:
        place, repeat = samples.gate[beats.first], samples.repeat[beats.first]
        names = [f"repeat {r} of phase_index {p}" for p, r in zip(place, repeat, strict=True)]
    elif samples.beat is not None:
        place = np.zeros(len(beats.first), dtype=np.int64)
        names = [f"beat {beat}" for beat in samples.beat[beats.first]]
    else:
        return
    order = np.argsort(beats.of, kind="stable")
    rows = [_key(part) for part in np.split(samples.speed_m_s[order], np.cumsum(beats.sizes)[:-1])]
    raise_any(
        Problem(
            samples.source,
            f"{names[second]} has the same {number} speeds as {names[first]}",
            REMEDY,
            column=SPEED,
        )
        for first, second, number in _copies(rows, place)
    )


def twins(recordings: Mapping[str, FloatArray]) -> dict[str, str]:
    """Return the recordings of a folder that have all speeds of another one, in whatever order, and which."""
    alike: dict[Block, list[str]] = {}
    for name, speed in recordings.items():
        alike.setdefault(_key(np.sort(speed)), []).append(name)
    several = [names for key, names in alike.items() if len(names) > 1 and _finite(key) >= LEAST]
    return {name: names[name == names[0]] for names in several for name in names}


def twin_refused(source: str, other: str) -> Problem:
    """Return what is wrong with a recording that has the speeds of another one."""
    return Problem(source, f"has the same speeds as the recording of {other}", REMEDY, column=SPEED)


def _copies(rows: Sequence[Block], place: IntArray) -> Iterator[tuple[int, int, int]]:
    """Yield pairs of equal rows, and of how many speeds, that chance does not make.

    The largest and the smallest speed do not count: a scanner may report them in place of any beyond.
    """
    at_once = np.bincount(place)
    beside = float((at_once * (at_once - 1) // 2).sum())
    every = 0.5 * len(rows) * (len(rows) - 1)
    chance = _chance_of_equal(rows, place)
    values = [value for row in rows for value in row if value is not None]
    low, high = min(values, default=0.0), max(values, default=0.0)
    first_of: dict[Block, int] = {}
    for second, row in enumerate(rows):
        first = first_of.setdefault(row, second)
        number = sum(value is not None and low < value < high for value in row)
        pairs = beside if place[first] == place[second] else every
        if first != second and number >= LEAST and pairs * chance**number < MOST_BY_CHANCE:
            yield first, second, _finite(row)


def _chance_of_equal(rows: Sequence[Block], place: IntArray) -> float:
    """Return how often two speeds are equal: of one recording, or in neighbouring rows of one phase."""
    values = np.array([value for row in rows for value in row if value is not None])
    if values.size < 2:
        return 1.0
    counts = np.unique(values, return_counts=True)[1]
    anywhere = float((counts * (counts - 1)).sum() / (values.size * (values.size - 1)))
    order = np.argsort(place, kind="stable")
    pairs = [
        (one, other)
        for first, second in pairwise(order.tolist())
        if place[first] == place[second] and rows[first] != rows[second]
        for one, other in zip(rows[first], rows[second], strict=False)
        if one is not None and other is not None
    ]
    return max(anywhere, float(np.mean([one == other for one, other in pairs])) if pairs else 0.0)


def _key(speed_m_s: FloatArray) -> Block:
    return tuple(None if value != value else value for value in speed_m_s.tolist())  # noqa: PLR0124


def _finite(row: Block) -> int:
    return sum(value is not None for value in row)
