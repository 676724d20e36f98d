"""How every search by CMA-ES asks its library ``cma`` to run: reproducibly, and in silence."""

from __future__ import annotations

from typing import Any

import numpy as np


def library_options(population_size: int, generations: int, rng: np.random.Generator) -> dict[str, Any]:
    """Return options of the library: sizes, a random stream of our own, silence, no files."""
    return {
        "popsize": population_size,
        "maxiter": generations,
        "randn": lambda *shape: rng.standard_normal(shape),
        "seed": np.nan,  # leaves NumPy's global random state alone
        "verbose": -9,
        "verb_log": 0,
        "verb_disp": 0,
    }
