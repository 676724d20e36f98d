"""Run spherical hearts of PhysioBlocks 2.0.1 to a periodic beat, one for each line of JSON that comes in.

A question has ``parameters``, by the program's names and in SI units, ``period_s`` and ``phases``. The answer
has the curves of the beat, or ``error``. The first line says which version runs. Needs `physioblocks` alone.

A run of the program begins in diastole at given arterial pressures. These are the slow modes of the open
loop: from the pressures at the ends of its last beats, where they are going is extrapolated (Aitken), and the
next run begins there, until two beats in a row agree.
"""

from __future__ import annotations

import contextlib
import importlib.metadata
import io
import json
import sys
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from physioblocks.configuration import load
from physioblocks.simulation.solvers import ConvergenceError
from physioblocks_beats import configuration

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


def run(parameters: Mapping[str, object], period_s: float, start_pa: float) -> pd.DataFrame:
    """Return the rows of ``BEATS`` beats, without what the program would do before and after them."""
    changes = {f"{name}.init": start_pa for name in PRESSURES}
    # Each beat has the same steps, so that two of them differ by their states alone.
    changes["time.step_size"] = period_s / np.ceil(period_s / LONGEST_STEP_S)
    plain = configuration(BEATS * period_s, {**parameters, **changes})
    for name in ("preprocesses", "postprocesses", "plots"):
        plain[name] = {}
    with contextlib.redirect_stdout(io.StringIO()):
        return load(plain).run()["main"]


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
    """Return the curves of a heart's periodic beat.

    Raises:
        RuntimeError: Two beats in a row do not agree after ``RUNS`` runs.
    """
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


def main() -> None:
    """Answer until there are no questions left."""
    print(json.dumps({"physioblocks": importlib.metadata.version("physioblocks")}), flush=True)
    for line in sys.stdin:
        print(json.dumps(answer(json.loads(line))), flush=True)


if __name__ == "__main__":
    main()
