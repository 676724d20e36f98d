"""Draw the forward model beside other simulators, and store how far it lies from them.

python benchmarks/forward_model_figures.py docs/figures --table docs/tables/other_simulators.csv
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from cases import ROOT, Cases, load_cases, with_numerics
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from references import Comparison, compare_with_physioblocks, compare_with_svzerod

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


def distances(comparisons: Sequence[Comparison]) -> pd.DataFrame:
    """Return a row for each program and quantity: root mean square difference, and the range of theirs."""
    rows = [
        {
            "program": each.program,
            "quantity": LABELS[name].rpartition(" (")[0].replace("$k_c$", "k_c"),
            "unit": LABELS[name].rpartition(" (")[2].rstrip(")"),
            "rmse": float(f"{each.rmse(name):.2g}"),
            "range": float(f"{np.ptp(theirs):.3g}"),
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
        "six-subjects": six_subjects(load_cases(1)),
    }
    for name, figure in figures.items():
        figure.savefig(folder / f"forward-model-{name}.png", dpi=150, metadata={"Software": None})
        plt.close(figure)


if __name__ == "__main__":
    main()
