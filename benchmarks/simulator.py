"""Accuracy and cost of the forward model beside other simulators, on one core: rows of ``peers.py``."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import lsoda
import numpy as np
import pandas as pd
from cases import ROOT, Cases, stiffness_errors
from references import compare_with_physioblocks

from swesbi.heart.model import build_model
from swesbi.heart.simulate import Beats, simulate

PHYSIOBLOCKS = ROOT / "data" / "other_hearts" / "program" / "physioblocks_hearts.py"
PUBLISHED = ROOT / "tests" / "reference" / "forward_model" / "physioblocks_spherical_heart.csv.gz"
FINE = 10  # steps of this model for each of PhysioBlocks'
INSTALL = "python -m venv physioblocks-env && physioblocks-env/bin/pip install physioblocks==2.0.1"
LSODA_RTOL = 1e-5
SIMULATION = "a simulation"


@dataclass(frozen=True)
class Row:
    """Processor time (s) of what is simulated, and the error of k_c relative to its peak; NaN: not known."""

    name: str
    what: str
    seconds: float
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
    seconds = float(np.mean(times)) / len(cases.theta)
    return Row("this model", SIMULATION, seconds, np.percentile(errors, 95), errors.max())


def scipy_lsoda(cases: Cases, exact: list[Beats], draws: int) -> Row:
    """Run the same equations by LSODA for the first draws of every subject."""
    rates = lsoda.compiled_rates(build_model(cases.contexts[0], cases.settings).options)
    lsoda.run_to_periodic(cases.theta[0], cases.contexts[0], cases.settings, rates, LSODA_RTOL)
    errors, simulations_s = [], 0.0
    for context, reference in zip(cases.contexts, exact, strict=True):
        for row in range(draws):
            begin = time.process_time()
            run = lsoda.run_to_periodic(cases.theta[row], context, cases.settings, rates, LSODA_RTOL)
            simulations_s += time.process_time() - begin
            true = reference.active_stiffness_kpa[row]
            errors.append(np.abs(run.active_stiffness_kpa - true).max() / true.max())
    count = draws * len(cases.contexts)
    name = f"SciPy LSODA, same equations, rtol {LSODA_RTOL:g}"
    return Row(name, SIMULATION, simulations_s / count, np.percentile(errors, 95), np.max(errors))


def physioblocks(python: str, beats: int) -> Row | None:
    """Run PhysioBlocks' own spherical heart, step 1 ms; None where that interpreter does not have it.

    Its error is the difference of its published beat from this model's with finer steps, where that heart is
    the same.
    """
    command = [python, str(PHYSIOBLOCKS), "--time", str(beats)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        reason = result.stderr.strip().splitlines()[-1:] or ["no output"]
        print(f"PhysioBlocks does not run under {python}: {reason[0]}\n  to install it apart: {INSTALL}\n")
        return None
    both = compare_with_physioblocks(pd.read_csv(PUBLISHED), FINE)
    ours, theirs = (values["active_stiffness_kpa"] for values in (both.ours, both.theirs))
    error = np.abs(ours - theirs) / theirs.max()
    seconds = float(result.stdout.split()[-1])
    return Row("PhysioBlocks 2.0.1, its own heart", "a beat", seconds, np.percentile(error, 95), error.max())
