"""Repeatable torch: a seed of one's own and one thread, both undone afterwards."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import torch


@contextmanager
def reproducible(seed: int) -> Iterator[None]:
    """Run the block under this seed on one thread.

    Sums split over threads differ in the last bit, so another number of threads would train another
    network; and these small networks run no faster on several.
    """
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with torch.random.fork_rng():
            torch.manual_seed(seed)
            yield
    finally:
        torch.set_num_threads(threads)
