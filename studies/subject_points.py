"""Points of subjects in rows with labels: what figures of several side studies share."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

MARKERS: Final = "osD^vPX*"
COLOURS: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C8C8C", "#000000")


def subject_points(axes: Axes, rows: pd.DataFrame, names: list[str], column: str) -> None:
    """Draw a column of rows, each at the height of its label among ``names``, a marker a subject."""
    subjects = list(dict.fromkeys(rows["subject"]))
    offsets = np.linspace(-0.28, 0.28, len(subjects)) if len(subjects) > 1 else np.zeros(1)
    for number, (subject, offset) in enumerate(zip(subjects, offsets, strict=True)):
        points = rows[rows["subject"] == subject]
        height = [names.index(label) + offset for label in points["label"]]
        look: dict[str, Any] = {
            "color": COLOURS[number % len(COLOURS)],
            "marker": MARKERS[number % len(MARKERS)],
        }
        axes.plot(points[column], height, linestyle="none", markersize=2.4, label=subject, **look)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.grid(axis="y", linewidth=0.3, color="#DDDDDD")
