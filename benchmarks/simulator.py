"""Accuracy and cost of the forward model beside other simulators, on one core.

    python benchmarks/simulator.py
    python benchmarks/simulator.py --physioblocks /path/to/python
    python benchmarks/simulator.py --table docs/tables/simulator.csv

PhysioBlocks is optional and pins other versions than this project, so it runs in an environment of its own.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import lsoda
import numpy as np
import pandas as pd
from cases import Cases, converged_beats, load_cases, stiffness_errors

from swesbi.base.workers import LIMIT
from swesbi.heart.model import build_model
from swesbi.heart.simulate import Beats, simulate

PHYSIOBLOCKS = Path(__file__).parents[1] / "data" / "other_hearts" / "program" / "physioblocks_hearts.py"
INSTALL = "python -m venv physioblocks-env && physioblocks-env/bin/pip install physioblocks==2.0.1"
LSODA_RTOL = 1e-5


@dataclass(frozen=True)
class Row:
    """One line of the table: cost, and error of k_c relative to its peak (NaN: not comparable)."""

    name: str
    ms_per_beat: float
    ms_per_simulation: float
    error_95: float
    error_worst: float


def best_of(repeats: int, work: Callable[[], object]) -> float:
    """Return the shortest processor time (s) of ``work``; what else the machine does can only add to it."""
    times = []
    for _ in range(repeats):
        begin = time.process_time()
        work()
        times.append(time.process_time() - begin)
    return min(times)


def this_model(cases: Cases, exact: list[Beats]) -> Row:
    """Time all draws of every subject to their periodic state; a beat has its share of that."""
    made = [simulate(cases.theta, context, cases.settings) for context in cases.contexts]
    times = [best_of(7, partial(simulate, cases.theta, each, cases.settings)) for each in cases.contexts]
    errors = np.concatenate([stiffness_errors(*both) for both in zip(made, exact, strict=True)])
    simulation_ms = 1e3 * float(np.mean(times)) / len(cases.theta)
    beats = float(np.mean([each.beats for each in made]))
    return Row("this model", simulation_ms / beats, simulation_ms, np.percentile(errors, 95), errors.max())


def scipy_lsoda(cases: Cases, exact: list[Beats], draws: int) -> Row:
    """Run the same equations by LSODA for the first draws of every subject."""
    rates = lsoda.compiled_rates(build_model(cases.contexts[0], cases.settings).options)
    lsoda.run_to_periodic(cases.theta[0], cases.contexts[0], cases.settings, rates, LSODA_RTOL)
    beats, errors, simulations_s = 0, [], 0.0
    for context, reference in zip(cases.contexts, exact, strict=True):
        for row in range(draws):
            begin = time.process_time()
            run = lsoda.run_to_periodic(cases.theta[row], context, cases.settings, rates, LSODA_RTOL)
            simulations_s += time.process_time() - begin
            beats += run.beats
            true = reference.active_stiffness_kpa[row]
            errors.append(np.abs(run.active_stiffness_kpa - true).max() / true.max())
    count = draws * len(cases.contexts)
    name = f"SciPy LSODA, same equations, rtol {LSODA_RTOL:g}"
    error_95, worst = np.percentile(errors, 95), np.max(errors)
    return Row(name, 1e3 * simulations_s / beats, 1e3 * simulations_s / count, error_95, worst)


def physioblocks(python: str, beats: int) -> Row | None:
    """Run PhysioBlocks' own spherical heart, step 1 ms; None where that interpreter does not have it."""
    command = [python, str(PHYSIOBLOCKS), "--time", str(beats)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        reason = result.stderr.strip().splitlines()[-1:] or ["no output"]
        print(f"PhysioBlocks does not run under {python}: {reason[0]}\n  to install it apart: {INSTALL}\n")
        return None
    seconds = float(result.stdout.split()[-1])
    return Row("PhysioBlocks 2.0.1 (its own heart, open loop)", 1e3 * seconds, np.nan, np.nan, np.nan)


def main() -> None:
    """Run everything and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--physioblocks", default=sys.executable, help="interpreter that has physioblocks")
    parser.add_argument("--draws", type=int, default=1_000, help="prior draws a subject")
    parser.add_argument("--table", type=Path, help="CSV to write")
    arguments = parser.parse_args()
    os.environ[LIMIT] = "1"
    cases = load_cases(arguments.draws)
    exact = converged_beats(cases)
    rows = [this_model(cases, exact), scipy_lsoda(cases, exact, draws=3)]
    other = physioblocks(arguments.physioblocks, beats=3)
    print(f"{arguments.draws} prior draws x {len(cases.contexts)} virtual volunteers, one core\n")
    rows += [other] if other else []
    table = pd.DataFrame([asdict(row) for row in rows])
    ratios = {f"{name}_ratio": table[name] / table[name][0] for name in ("ms_per_beat", "ms_per_simulation")}
    print(table.assign(**ratios).to_string(index=False, float_format="%.3g"))
    print("processor time of one core; a simulation runs to its periodic state")
    print("error: of k_c over the beat, relative to its peak, against 6400 steps and 1e-10 of change a beat")
    if arguments.table:
        table.to_csv(arguments.table, index=False, float_format="%.3g", lineterminator="\n")


if __name__ == "__main__":
    main()
