"""Draw the forward model beside other simulators, and store how far it lies from them.

python benchmarks/forward_model_figures.py docs/figures --table docs/tables/other_simulators.csv
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import lsoda
import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from cases import ROOT, Cases, converged_beats, load_cases, stiffness_errors, with_numerics
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from references import Comparison, compare_with_physioblocks, compare_with_svzerod

from swesbi.heart.model import build_model
from swesbi.heart.simulate import Beats, simulate

REFERENCE = ROOT / "tests" / "reference" / "forward_model"
CENTRE = np.array([[45.0, 5.0, 30.0]])
OURS, THEIRS = "#0072B2", "#E69F00"
SUBJECT_COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#D55E00", "#56B4E9")
LABELS = {
    "volume_ml": "volume (mL)",
    "ventricular_pressure_mmhg": "ventricular pressure (mmHg)",
    "active_stiffness_kpa": "active stiffness $k_c$ (kPa)",
    "aortic_flow_ml_s": "aortic flow (mL/s)",
    "mitral_flow_ml_s": "mitral flow (mL/s)",
    "radial_displacement_mm": "radial displacement (mm)",
    "active_stress_kpa": "active stress (kPa)",
}
STEPS = (100, 200, 400, 800, 1600)
RTOL = (1e-3, 1e-4, 1e-5, 1e-6)


def overlay(comparison: Comparison, columns: int) -> Figure:
    """Draw every compared quantity of both programs over time, with its RMSE."""
    names = list(comparison.ours)
    rows = -(-len(names) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(3.2 * columns, 2.6 * rows), squeeze=False)
    for axis, name in zip(axes.flat, names, strict=False):
        axis.plot(comparison.time_s, comparison.theirs[name], color=THEIRS, lw=3.5, label=comparison.program)
        axis.plot(comparison.time_s, comparison.ours[name], color=OURS, lw=1.2, ls="--", label="this model")
        axis.set_xlabel("time (s)")
        axis.set_title(f"{LABELS[name]}\nRMSE {comparison.rmse(name):.2g}", fontsize=9)
    for axis in axes.flat[len(names) :]:
        axis.set_axis_off()
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=2, frameon=False)
    figure.tight_layout(rect=(0.0, 0.05 if rows > 1 else 0.1, 1.0, 1.0))
    return figure


def six_subjects(cases: Cases) -> Figure:
    """Draw one beat of each virtual volunteer at the prior's centre, nothing fitted."""
    figure, axes = plt.subplots(2, 3, figsize=(11.0, 6.2))
    fine = with_numerics(cases.settings, steps_per_beat=2000, samples_per_beat=2000)
    for colour, context in zip(SUBJECT_COLOURS, cases.contexts, strict=True):
        _draw_subject(list(axes.flat), simulate(CENTRE, context, fine), context.subject, colour)
    titles = (
        ("volume (mL)", "ventricular pressure (mmHg)"),
        ("phase of the cycle", "active stiffness $k_c$ (kPa)"),
        ("phase of the cycle", "volume (mL)"),
        ("phase of the cycle", "pressure (mmHg): ventricle, arteries (dotted)"),
        ("phase of the cycle", "flow (mL/s): aortic, mitral (dotted)"),
        ("ventricular pressure (mmHg)", "active stiffness $k_c$ (kPa)"),
    )
    for axis, (x, y) in zip(axes.flat, titles, strict=True):
        axis.set_xlabel(x)
        axis.set_title(y, fontsize=10)
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, title="virtual volunteer", loc="lower center", ncols=6, frameon=False)
    figure.tight_layout(rect=(0.0, 0.07, 1.0, 1.0))
    return figure


def _draw_subject(axes: list[Axes], beats: Beats, subject: str, colour: str) -> None:
    phase, pressure = beats.cycle_phase, beats.ventricular_pressure_mmhg[0]
    volume, stiffness = beats.volume_ml[0], beats.active_stiffness_kpa[0]
    axes[0].plot(volume, pressure, color=colour, label=subject)
    axes[1].plot(phase, stiffness, color=colour)
    axes[2].plot(phase, volume, color=colour)
    axes[3].plot(phase, pressure, color=colour)
    axes[3].plot(phase, beats.arterial_pressure_mmhg[0], color=colour, ls=":")
    axes[4].plot(phase, beats.aortic_flow_ml_s[0], color=colour)
    axes[4].plot(phase, beats.mitral_flow_ml_s[0], color=colour, ls=":")
    axes[5].plot(pressure, stiffness, color=colour)


def accuracy_cost(cases: Cases, lsoda_draws: int) -> Figure:
    """Draw the error of k_c against the cost of a simulation, for steps of this model and for LSODA."""
    exact = converged_beats(cases)
    ours = np.array([_this_model(cases, exact, steps) for steps in STEPS])
    scipy = np.array([_lsoda(cases, exact, rtol, lsoda_draws) for rtol in RTOL])
    figure, axis = plt.subplots(figsize=(6.2, 4.4))
    for points, colour, name in ((ours, OURS, "this model"), (scipy, THEIRS, "SciPy LSODA, same equations")):
        axis.loglog(points[:, 0], points[:, 1], "o-", color=colour, label=f"{name}: 95 % of draws")
        axis.loglog(points[:, 0], points[:, 2], "s:", color=colour, mfc="white", label=f"{name}: worst")
    for point, steps in zip(ours, STEPS, strict=True):
        shipped = " steps (shipped)" if steps == cases.settings.steps_per_beat else " steps"
        axis.annotate(
            f"{steps}{shipped}",
            point[:2],
            xytext=(-9, -3),
            textcoords="offset points",
            fontsize=8,
            ha="right",
        )
    for point, rtol in zip(scipy, RTOL, strict=True):
        axis.annotate(f"rtol {rtol:g}", point[:2], xytext=(4, -12), textcoords="offset points", fontsize=8)
    axis.axhline(1e-3, color="0.6", lw=0.8, zorder=0)
    axis.axvline(0.08, color="0.6", lw=0.8, zorder=0)
    axis.set(xlabel="processor time per simulation to its periodic state (ms)")
    axis.set_ylabel("error of $k_c$ relative to its peak")
    axis.set_xlim(0.1 * ours[:, 0].min(), 6.0 * scipy[:, 0].max())
    axis.set_ylim(0.4 * ours[:, 1].min(), 0.4)
    axis.legend(frameon=False, fontsize=8, loc="upper center")
    figure.tight_layout()
    return figure


def _this_model(cases: Cases, exact: list[Beats], steps: int) -> tuple[float, float, float]:
    settings = with_numerics(
        cases.settings, steps_per_beat=steps, maximum_step_s=1.0, samples_per_beat=min(steps, 200)
    )
    errors, seconds = [], 0.0
    for context, reference in zip(cases.contexts, exact, strict=True):
        errors.append(stiffness_errors(simulate(cases.theta, context, settings), reference))
        seconds += _best_of(3, partial(simulate, cases.theta, context, settings))
    everything = np.concatenate(errors)
    return 1e3 * seconds / everything.size, float(np.percentile(everything, 95)), float(everything.max())


def _lsoda(cases: Cases, exact: list[Beats], rtol: float, draws: int) -> tuple[float, float, float]:
    rates = lsoda.compiled_rates(build_model(cases.contexts[0], cases.settings).options)
    lsoda.run_to_periodic(cases.theta[0], cases.contexts[0], cases.settings, rates, rtol)
    errors = []
    begin = time.process_time()
    for context, reference in zip(cases.contexts, exact, strict=True):
        for theta, curve in zip(cases.theta[:draws], reference.active_stiffness_kpa, strict=False):
            run = lsoda.run_to_periodic(theta, context, cases.settings, rates, rtol)
            errors.append(np.abs(run.active_stiffness_kpa - curve).max() / curve.max())
    seconds = time.process_time() - begin
    return 1e3 * seconds / len(errors), float(np.percentile(errors, 95)), float(np.max(errors))


def _best_of(repeats: int, work: Callable[[], object]) -> float:
    times = []
    for _ in range(repeats):
        begin = time.process_time()
        work()
        times.append(time.process_time() - begin)
    return min(times)


def distances(comparisons: Sequence[Comparison]) -> pd.DataFrame:
    """Return a row for each program and quantity: root mean square difference, and the range of theirs."""
    rows = [
        {
            "program": each.program,
            "quantity": LABELS[name].rpartition(" (")[0].replace("$k_c$", "k_c"),
            "unit": LABELS[name].rpartition(" (")[2].rstrip(")"),
            "rmse": float(f"{each.rmse(name):.2g}"),
            "range": float(f"{np.ptp(theirs):.3g}"),
            "rmse_of_range": float(f"{each.rmse(name) / np.ptp(theirs):.2g}"),
        }
        for each in comparisons
        for name, theirs in each.theirs.items()
    ]
    return pd.DataFrame(rows)


def main() -> None:
    """Write the figures into the folder of the first argument, and the table where one is named."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--table", type=Path, help="CSV to write: distances from the other programs")
    options = parser.parse_args()
    folder = options.folder
    folder.mkdir(parents=True, exist_ok=True)
    physioblocks = compare_with_physioblocks(pd.read_csv(REFERENCE / "physioblocks_spherical_heart.csv.gz"))
    svzerod = compare_with_svzerod(pd.read_csv(REFERENCE / "svzerod_chamber_sphere.csv.gz"))
    if options.table:
        distances((physioblocks, svzerod)).to_csv(options.table, index=False, lineterminator="\n")
    figures = {
        "physioblocks": overlay(physioblocks, columns=3),
        "svzerod": overlay(svzerod, columns=3),
        "six-subjects": six_subjects(load_cases(1)),
        "accuracy-cost": accuracy_cost(load_cases(1_000), lsoda_draws=3),
    }
    for name, figure in figures.items():
        figure.savefig(folder / f"forward-model-{name}.png", dpi=150, metadata={"Software": None})
        plt.close(figure)


if __name__ == "__main__":
    main()
