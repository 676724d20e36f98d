"""Independent random streams, named by what they are for.

A stream depends on the study's seed and on its names alone, never on the number of cores or
shards or on the order of jobs. Names become ``SeedSequence`` spawn keys.
"""

from __future__ import annotations

import hashlib

import numpy as np


def spawn_key(*names: str | int) -> tuple[int, ...]:
    """Turn names into a spawn key: integers stay, texts become 32-bit words of their SHA-256."""
    return tuple(name if isinstance(name, int) else _word(name) for name in names)


def seed_sequence(seed: int, *names: str | int) -> np.random.SeedSequence:
    """Return the seed sequence of the stream ``names`` under the study's ``seed``."""
    return np.random.SeedSequence(seed, spawn_key=spawn_key(*names))


def generator(seed: int, *names: str | int) -> np.random.Generator:
    """Return the NumPy generator of the stream ``names`` under the study's ``seed``."""
    return np.random.default_rng(seed_sequence(seed, *names))


def integer_seed(seed: int, *names: str | int) -> int:
    """Return a 32-bit seed of the stream ``names``, for libraries that take a plain integer."""
    return int(seed_sequence(seed, *names).generate_state(1)[0])


def _word(name: str) -> int:
    return int.from_bytes(hashlib.sha256(name.encode()).digest()[:4], "big")
