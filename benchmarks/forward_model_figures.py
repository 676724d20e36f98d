"""Draw the forward model beside other simulators, and store how far it lies from them.

python benchmarks/forward_model_figures.py docs/figures --table docs/tables/other_simulators.csv
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from cases import ROOT, Cases, load_cases, with_numerics
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from references import Comparison, compare_with_physioblocks, compare_with_svzerod

from swesbi.heart.simulate import Beats, simulate
from swesbi.report.figures.style import (
    OBSERVED,
    SERIES,
    drawing,
    few_ticks,
    save_figure,
    shared_legend,
)

REFERENCE = ROOT / "tests" / "reference" / "forward_model"
CENTRE = np.array([[45.0, 5.0, 30.0]])
PANEL_IN = (2.3, 1.7)
FRAME_IN = 0.5
OTHER = SERIES[4]
LABELS = {
    "volume_ml": "volume (mL)",
    "ventricular_pressure_mmhg": "ventricular pressure (mmHg)",
    "active_stiffness_kpa": "active stiffness $k_c$ (kPa)",
    "aortic_flow_ml_s": "aortic flow (mL/s)",
    "mitral_flow_ml_s": "mitral flow (mL/s)",
    "radial_displacement_mm": "radial displacement (mm)",
    "active_stress_kpa": "active stress (kPa)",
}
PANELS = (
    ("volume_ml", ("ventricular_pressure_mmhg",), LABELS["ventricular_pressure_mmhg"]),
    ("phase", ("active_stiffness_kpa",), LABELS["active_stiffness_kpa"]),
    ("phase", ("volume_ml",), LABELS["volume_ml"]),
    (
        "phase",
        ("ventricular_pressure_mmhg", "arterial_pressure_mmhg"),
        "pressure (mmHg): ventricle, arteries (dotted)",
    ),
    ("phase", ("aortic_flow_ml_s", "mitral_flow_ml_s"), "flow (mL/s): aortic, mitral (dotted)"),
    ("ventricular_pressure_mmhg", ("active_stiffness_kpa",), LABELS["active_stiffness_kpa"]),
)
"""Along what, which curves of a beat, and the title."""


def overlay(comparison: Comparison, columns: int) -> Figure:
    """Draw every compared quantity of both programs over time, with its RMSE."""
    names = list(comparison.ours)
    rows = -(-len(names) // columns)
    with drawing(PANEL_IN[0] * columns, PANEL_IN[1] * rows + FRAME_IN) as figure:
        axes = list(figure.subplots(rows, columns, squeeze=False).flat)
        for axis, name in zip(axes, names, strict=False):
            axis.plot(
                comparison.time_s, comparison.theirs[name], color=OTHER, lw=3.5, label=comparison.program
            )
            axis.plot(comparison.time_s, comparison.ours[name], "--", color=OBSERVED, label="this model")
            axis.set(xlabel="time (s)", title=f"{LABELS[name]}\nRMSE {comparison.rmse(name):.2g}")
            axis.xaxis.set_major_locator(few_ticks())
        for axis in axes[len(names) :]:
            axis.remove()
        shared_legend(figure, axes[:1], entries_a_row=2)
    return figure


def six_subjects(cases: Cases) -> Figure:
    """Draw one beat of each virtual volunteer at the prior's centre, nothing fitted."""
    fine = with_numerics(cases.settings, steps_per_beat=2000, samples_per_beat=2000)
    with drawing(3 * PANEL_IN[0], 2 * PANEL_IN[1] + FRAME_IN) as figure:
        axes = list(figure.subplots(2, 3).flat)
        for colour, context in zip(SERIES, cases.contexts, strict=False):
            beats = simulate(CENTRE, context, fine)
            _draw_subject(axes, beats, f"volunteer {context.subject}", colour)
        for axis, (x, _, title) in zip(axes, PANELS, strict=True):
            axis.set(xlabel={"phase": "phase of the cycle", **LABELS}[x], title=title)
        shared_legend(figure, axes[:1], entries_a_row=6)
    return figure


def _draw_subject(axes: list[Axes], beats: Beats, subject: str, colour: str) -> None:
    curves = {name: getattr(beats, name)[0] for _, names, _ in PANELS for name in names}
    curves |= {"phase": beats.cycle_phase}
    for axis, (x, names, _) in zip(axes, PANELS, strict=True):
        for name, line in zip(names, ("-", ":"), strict=False):
            axis.plot(curves[x], curves[name], color=colour, ls=line, label=subject if line == "-" else None)


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
        save_figure(figure, folder / f"forward-model-{name}.png")


if __name__ == "__main__":
    main()
