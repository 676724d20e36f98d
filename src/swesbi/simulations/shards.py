"""How a subject's draws are split into shards."""

from __future__ import annotations


def shard_draws(shard: int, shards: int, draws: int) -> range:
    """Return the draw numbers of one shard: contiguous, the shards as equal in size as can be.

    Raises:
        ValueError: The shard does not exist.
    """
    if not 0 <= shard < shards:
        raise ValueError(f"shard {shard} does not exist: there are {shards}, numbered from 0")
    return range(shard * draws // shards, (shard + 1) * draws // shards)
