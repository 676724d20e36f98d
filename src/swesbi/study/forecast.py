"""What a run will take on this machine, said at its start, and what it took, at its end.

Stored costs are those of a finished study on one machine (docs/tables/study_cost.csv, `benchmarks/study.py`).
A fixed piece of work, timed there and here, says how much faster or slower this machine is now.
"""

from __future__ import annotations

import csv
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from threadpoolctl import threadpool_limits

MATRIX: Final = 400
PRODUCTS: Final = 150
VALUES: Final = 400_000
BENCHMARK: Final = "benchmark_s"
"""Column of the stored costs: what the fixed work took on their machine."""


def benchmark_s() -> float:
    """Return how long a fixed piece of work takes here and now, about a second: products and exponentials."""
    rng = np.random.default_rng(0)
    matrix, values = rng.standard_normal((MATRIX, MATRIX), dtype=np.float32), rng.random(VALUES)
    start = time.perf_counter()
    with threadpool_limits(limits=1):  # as in a job
        for _ in range(PRODUCTS):
            np.exp(-((matrix @ matrix) ** 2))
            np.exp(-(values**2)).sum()
    return time.perf_counter() - start


@dataclass(frozen=True)
class StageCost:
    """Wall time of one run of a stage, and of the fixed work on the machine that it ran on; seconds."""

    run_s: float
    benchmark_s: float


def read_costs(path: Path) -> dict[str, StageCost]:
    """Read the stored costs by stage."""
    with path.open(encoding="utf-8", newline="") as file:
        return {
            row["stage"]: StageCost(float(row["wall_s"]) / float(row["runs"]), float(row[BENCHMARK]))
            for row in csv.DictReader(file)
        }


def expected_s(
    stages: Sequence[str], cores: int, costs: Mapping[str, StageCost], benchmark_here_s: float
) -> float | None:
    """Return the seconds that runs of these stages will take on so many cores; None where one has no cost.

    They are taken to fill the cores, but none is shorter than itself.
    """
    if any(stage not in costs for stage in stages):
        return None
    runs = [costs[stage].run_s * benchmark_here_s / costs[stage].benchmark_s for stage in stages]
    return max(sum(runs) / cores, max(runs, default=0.0))


class Run:
    """One run of the workflow: what is said when it begins and when it has ended.

    Args:
        costs: The stored costs; None where the run is of other settings than theirs.
    """

    def __init__(self, costs: Path | None) -> None:
        self._costs = costs
        self._expected_s: float | None = None
        self._start = time.monotonic()

    def begun(self, jobs: Sequence[Sequence[str]], cores: int | None) -> str:
        """Return the line at the start of a run.

        Args:
            jobs: The stages that each job is to run, by the names by which costs are stored.
            cores: Of this machine that it may use; None on a cluster, whose machines nobody has timed.
        """
        self._start = time.monotonic()
        if self._costs is not None and cores is not None:
            stages = [stage for job in jobs for stage in job]
            self._expected_s = expected_s(stages, cores, read_costs(self._costs), benchmark_s())
        line = f"{len(jobs)} job{'' if len(jobs) == 1 else 's'}"
        return line if self._expected_s is None else f"{line}, about {_minutes(self._expected_s)} here"

    def ended(self) -> str:
        """Return the line at the end."""
        line = f"The run took {_minutes(time.monotonic() - self._start)}"
        return line if self._expected_s is None else f"{line}; {_minutes(self._expected_s)} were expected"


def _minutes(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 90.0 else f"{seconds / 60.0:.0f} min"
