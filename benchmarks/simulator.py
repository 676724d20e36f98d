"""Accuracy and cost of the forward model beside other simulators, on one core; then what threads gain.

    python benchmarks/simulator.py
    python benchmarks/simulator.py --physioblocks /path/to/python --largest 1000000
    python benchmarks/simulator.py --table docs/tables/simulator.csv

PhysioBlocks is optional and pins other versions than this project, so it runs in an environment of its own:

    python -m venv /tmp/physioblocks && /tmp/physioblocks/bin/pip install physioblocks==2.0.1
    python benchmarks/simulator.py --physioblocks /tmp/physioblocks/bin/python
"""

from __future__ import annotations

import argparse
import csv
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
from cases import Cases, converged_beats, load_cases, stiffness_errors
from numpy.typing import NDArray

from swesbi.base.threads import LIMIT, usable
from swesbi.heart.kernel import LANES, RECORDS, beat_kernel
from swesbi.heart.model import build_model
from swesbi.heart.periodic import lane_blocks
from swesbi.heart.simulate import simulate

HERE = Path(__file__).parent
INSTALL = "python -m venv /tmp/physioblocks && /tmp/physioblocks/bin/pip install physioblocks==2.0.1"
LSODA_RTOL = 1e-5
CHUNK = 10_000  # simulations a call: their curves take 0.1 GB


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


def this_model(cases: Cases, errors: NDArray[np.float64]) -> Row:
    """Time a beat of full lanes, and all draws of one subject to their periodic state."""
    model = build_model(cases.contexts[0], cases.settings)
    blocks = 16
    theta = np.resize(cases.theta, (blocks * LANES, 3)) * np.array([1e3, 1.0, 1.0])
    state = lane_blocks(np.repeat(model.start[None], blocks * LANES, axis=0), blocks)
    own = lane_blocks(theta, blocks)
    record = np.empty((blocks, model.samples + 1, RECORDS * LANES))
    advance = beat_kernel(model.options)
    shared = (model.parameters, model.drives, model.step_s, model.stride, record)
    numbers = (*shared, np.empty((0, 0)), np.zeros((blocks, LANES), np.int64))  # no activation of their own
    beat_s = best_of(50, lambda: advance(state.copy(), own, *numbers)) / (blocks * LANES)
    per_subject = [
        best_of(7, partial(simulate, cases.theta, context, cases.settings)) for context in cases.contexts
    ]
    simulation_s = float(np.mean(per_subject)) / cases.theta.shape[0]
    error_95, worst = np.percentile(errors, 95), errors.max()
    return Row("this model", 1e3 * beat_s, 1e3 * simulation_s, error_95, worst)


def scipy_lsoda(cases: Cases, exact: list[NDArray[np.float64]], draws: int) -> Row:
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
            errors.append(np.abs(run.active_stiffness_kpa - reference[row]).max() / reference[row].max())
    count = draws * len(cases.contexts)
    name = f"SciPy LSODA, same equations, rtol {LSODA_RTOL:g}"
    error_95, worst = np.percentile(errors, 95), np.max(errors)
    return Row(name, 1e3 * simulations_s / beats, 1e3 * simulations_s / count, error_95, worst)


def physioblocks(python: str, beats: int) -> Row | None:
    """Run PhysioBlocks' own spherical heart, step 1 ms; None where that interpreter does not have it."""
    command = [python, str(HERE / "physioblocks_beats.py"), str(beats)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        reason = result.stderr.strip().splitlines()[-1:] or ["no output"]
        print(f"PhysioBlocks does not run under {python}: {reason[0]}\n  to install it apart: {INSTALL}")
        print("  then: python benchmarks/simulator.py --physioblocks /tmp/physioblocks/bin/python\n")
        return None
    seconds = float(result.stdout.split()[-1])
    return Row("PhysioBlocks 2.0.1 (its own heart, open loop)", 1e3 * seconds, np.nan, np.nan, np.nan)


def print_table(rows: list[Row]) -> None:
    """Print the rows with their cost relative to the first."""
    print(" " * 48 + "    ms/beat     ratio  ms/simulation    ratio  error 95 %     worst")
    first = rows[0]
    for row in rows:
        per_beat = row.ms_per_beat / first.ms_per_beat
        per_simulation = row.ms_per_simulation / first.ms_per_simulation
        cost = f"{row.ms_per_beat:11.4f}{per_beat:10,.0f}{row.ms_per_simulation:15.4f}{per_simulation:9,.0f}"
        print(f"{row.name:48s}{cost}{row.error_95:12.1e}{row.error_worst:10.1e}")
    print("processor time of one core; a simulation runs to its periodic state")
    print(
        "error: of k_c over the beat, relative to its peak, against 6400 steps and 1e-10 of change a beat\n"
    )


def write_table(rows: list[Row], path: Path) -> None:
    """Write the rows as CSV, numbers with three significant digits."""
    plain = [
        {name: f"{value:.3g}" if isinstance(value, float) else value for name, value in asdict(row).items()}
        for row in rows
    ]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, plain[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(plain)


def print_growth(cases: Cases, largest: int) -> None:
    """Print simulations per second to the periodic state for growing batches."""
    print(f"{'simulations':>12s}{'seconds':>10s}{'per second':>12s}")
    count = 1_000
    while count <= largest:
        theta = np.resize(cases.theta, (count, 3))
        chunks = [theta[first : first + CHUNK] for first in range(0, count, CHUNK)]

        def all_chunks(chunks: list[NDArray[np.float64]] = chunks) -> None:
            for index, chunk in enumerate(chunks):
                simulate(chunk, cases.contexts[index % len(cases.contexts)], cases.settings)

        seconds = best_of(3 if count <= 10_000 else 1, all_chunks)
        print(f"{count:12,d}{seconds:10.2f}{count / seconds:12,.0f}")
        count *= 10


def print_threads(cases: Cases, most: int, rounds: int = 30) -> None:
    """Print what a call takes in 1, 2, 4, ... threads, in turn: medians, also of ratios to one thread."""
    counts = [2**power for power in range(most.bit_length())]
    seconds = np.empty((rounds, len(counts), 2))
    for one in seconds:
        for count, taken in zip(counts, one, strict=True):
            os.environ[LIMIT] = str(count)
            begin = time.perf_counter(), time.process_time()
            simulate(cases.theta, cases.contexts[0], cases.settings)
            taken[:] = time.perf_counter() - begin[0], time.process_time() - begin[1]
    medians, ratios = np.median(seconds, axis=0), np.median(seconds / seconds[:, :1], axis=0)
    print(f"\n{cases.theta.shape[0]} simulations a call, {rounds} calls each")
    print(f"{'threads':>12s}{'wall ms':>10s}{'ratio':>8s}{'processor ms':>14s}{'ratio':>8s}")
    for count, (wall, cpu), (of_wall, of_cpu) in zip(counts, 1e3 * medians, ratios, strict=True):
        print(f"{count:12d}{wall:10.1f}{of_wall:8.2f}{cpu:14.1f}{of_cpu:8.2f}")


def main() -> None:
    """Run everything and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--physioblocks", default=sys.executable, help="interpreter that has physioblocks")
    parser.add_argument("--largest", type=int, default=1_000_000, help="largest batch of the growth table")
    parser.add_argument("--draws", type=int, default=1_000, help="prior draws a subject")
    parser.add_argument("--table", type=Path, help="CSV to write")
    arguments = parser.parse_args()
    most = usable()
    os.environ[LIMIT] = "1"
    cases = load_cases(arguments.draws)
    exact = converged_beats(cases)
    errors = np.concatenate(
        [
            stiffness_errors(simulate(cases.theta, context, cases.settings), reference)
            for context, reference in zip(cases.contexts, exact, strict=True)
        ]
    )
    rows = [this_model(cases, errors), scipy_lsoda(cases, [e.active_stiffness_kpa for e in exact], draws=3)]
    other = physioblocks(arguments.physioblocks, beats=3)
    print(f"{arguments.draws} prior draws x {len(cases.contexts)} virtual volunteers, one core\n")
    rows += [other] if other else []
    print_table(rows)
    if arguments.table:
        write_table(rows, arguments.table)
    print_growth(cases, arguments.largest)
    print_threads(cases, most)


if __name__ == "__main__":
    main()
