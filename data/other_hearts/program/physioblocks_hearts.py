"""Run spherical hearts of PhysioBlocks 2.0.1 to a periodic beat, one for each line of JSON that comes in.

A question has ``parameters``, by the program's names and in SI units, ``period_s`` and ``phases``. The answer
has the curves of the beat, or ``error``. The first line says which version runs. Needs `physioblocks` alone.
With ``--time BEATS`` it times so many beats of its own reference heart, and prints seconds a beat.

A run of the program begins in diastole at given arterial pressures. These are the slow modes of the open
loop: from the pressures at the ends of its last beats, where they are going is extrapolated (Aitken), and the
next run begins there, until two beats in a row agree.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import importlib.metadata
import io
import json
import pkgutil
import sys
import time
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd
import physioblocks.library
from numpy.typing import NDArray
from physioblocks.configuration import load, unwrap_aliases
from physioblocks.io.aliases import load_aliases
from physioblocks.io.configuration import read_json
from physioblocks.simulation.solvers import ConvergenceError

Array = NDArray[np.float64]

PA_PER_MMHG: Final = 133.322387415
COLUMNS: Final = {  # curve -> the program's column, and the curve's unit in the column's
    "active_kpa": ("cavity.rheology.active_law.active_stiffness", 1e-3),
    "stretch": ("cavity.dynamics.disp", 1.0),
    "volume_ml": ("cavity.volume", 1e6),
    "ventricular_mmhg": ("cavity.blood_pressure", 1.0 / PA_PER_MMHG),
    "arterial_mmhg": ("aorta_proximal.blood_pressure", 1.0 / PA_PER_MMHG),
}
PRESSURES: Final = ("aorta_proximal.blood_pressure", "aorta_distal.blood_pressure")
START_PA: Final = 10760.0  # of both, in the program's reference heart
LONGEST_STEP_S: Final = 1e-3  # that of the reference heart
BEATS: Final = 4  # of a run
RUNS: Final = 6
PERIODIC: Final = 1e-3  # largest difference between two beats, over the largest value of the curve


@cache
def load_library() -> Path:
    """Make the program's blocks and aliases known; return the folder that it is installed in."""
    for module in pkgutil.walk_packages(physioblocks.library.__path__, "physioblocks.library."):
        importlib.import_module(module.name)
    root = Path(physioblocks.__file__).parent
    load_aliases(str(root / "library" / "aliases"))
    return root


def configuration(duration_s: float, changes: Mapping[str, object]) -> Any:  # noqa: ANN401  the package is untyped
    """Return its reference simulation (one beat a second, step 1 ms), cut to this duration, as configured."""
    shipped = read_json(str(load_library() / "references" / "spherical_heart_forward_sim.jsonc"))
    shipped["parameters"] |= {**changes, "time.duration": duration_s}
    return unwrap_aliases(shipped)


def run(parameters: Mapping[str, object], period_s: float, start_pa: float) -> pd.DataFrame:
    """Return the rows of ``BEATS`` beats, without what the program would do before and after them."""
    changes = {f"{name}.init": start_pa for name in PRESSURES}
    # Each beat has the same steps, so that two of them differ by their states alone.
    changes["time.step_size"] = period_s / np.ceil(period_s / LONGEST_STEP_S)
    plain = configuration(BEATS * period_s, {**parameters, **changes})
    for name in ("preprocesses", "postprocesses", "plots"):
        plain[name] = {}
    with contextlib.redirect_stdout(io.StringIO()):
        rows: pd.DataFrame = load(plain).run()["main"]
    return rows


def beat(rows: pd.DataFrame, number: int, period_s: float, phases: int, radius: float) -> dict[str, Array]:
    """Return the curves of one beat, counted from zero, at uniform phases."""
    time_s = period_s * (number + np.arange(phases) / phases)
    curves = {
        name: scale * np.interp(time_s, rows["time"], rows[column])
        for name, (column, scale) in COLUMNS.items()
    }
    return curves | {"stretch": 1.0 + curves["stretch"] / radius}


def difference(one: Mapping[str, Array], other: Mapping[str, Array]) -> float:
    """Return the largest difference between two beats, each curve over its largest value."""
    return max(float(np.max(np.abs(one[name] - other[name])) / np.max(np.abs(one[name]))) for name in one)


def extrapolated(rows: pd.DataFrame, period_s: float) -> float:
    """Return where the distal pressure at the end of a beat is going, from the last three of them."""
    ends_s = period_s * np.arange(BEATS - 2, BEATS + 1)
    first, second, third = np.interp(ends_s, rows["time"], rows[PRESSURES[1]])
    slowing = (third - second) - (second - first)
    if abs(slowing) < 1e-6 * abs(third):
        return float(third)
    limit = third - (third - second) ** 2 / slowing
    return float(limit if 0.2 * third < limit < 5.0 * third else third)


def periodic_beat(parameters: Mapping[str, Any], period_s: float, phases: int) -> dict[str, Array]:
    """Return the curves of a heart's beat; a RuntimeError where two in a row disagree after ``RUNS`` runs."""
    start_pa, apart = START_PA, np.inf
    for _ in range(RUNS):
        rows = run(parameters, period_s, start_pa)
        before, last = (
            beat(rows, number, period_s, phases, parameters["heart_radius"])
            for number in (BEATS - 2, BEATS - 1)
        )
        apart = difference(before, last)
        if apart < PERIODIC:
            return last
        start_pa = extrapolated(rows, period_s)
    raise RuntimeError(f"beats still differ by {apart:.1e} after {RUNS} runs")


def answer(question: Mapping[str, Any]) -> dict[str, object]:
    """Return the beat that a question asks for, or why there is none."""
    try:
        curves = periodic_beat(question["parameters"], question["period_s"], question["phases"])
    except (ConvergenceError, RuntimeError, ValueError) as error:
        return {"error": f"{type(error).__name__}: {error}"}
    return {name: curve.tolist() for name, curve in curves.items()}


def seconds_per_beat(beats: int) -> float:
    """Return the processor time that a beat of the program's own reference heart takes."""
    heart = load(configuration(float(beats), {}))
    begin = time.process_time()
    heart.run()
    return (time.process_time() - begin) / beats


def main() -> None:
    """Time the reference heart where that is asked for; else answer until there are no questions left."""
    parser = argparse.ArgumentParser(description="Run hearts of PhysioBlocks.")
    parser.add_argument("--time", type=int, metavar="BEATS", help="beats of the reference heart to time")
    beats = parser.parse_args().time
    if beats:
        print(f"seconds_per_beat {seconds_per_beat(beats):.6f}")
        return
    print(json.dumps({"physioblocks": importlib.metadata.version("physioblocks")}), flush=True)
    for line in sys.stdin:
        print(json.dumps(answer(json.loads(line))), flush=True)


if __name__ == "__main__":
    main()
