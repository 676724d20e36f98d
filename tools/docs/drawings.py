"""Two drawings of the pages: what is recorded, and how a recording becomes an answer."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch, Rectangle

from swesbi.base.arrays import FloatArray
from swesbi.config.study import Study
from swesbi.report.figures.style import EXCLUDED_BACKGROUND, OBSERVED, POSTERIOR, PRIOR, SERIES, drawing
from swesbi.virtual.push_trains import PUSHES_PER_S

BEATS: Final = 3
BEAT_S: Final = 0.9
DELAYS_S: Final = (0.05, 0.23, 0.41, 0.59)
"""Of four of the gates, after the R peak."""
TRAIN_BEATS: Final = 1.8
STEPS: Final = (
    ("Recording", "a speed at each phase,\nits error from repeats"),
    ("Network", "proposes hearts that may\nhave made it"),
    ("Simulator", "the beat of each heart,\nand its speeds"),
    ("Likelihood", "weights each heart by how\nwell its speeds fit"),
    ("Posterior", "strength and rates of the\nmuscle, with intervals"),
)
CHECKS: Final = (
    (3, "Sampling check", "enough draws with weight?\nElse Markov chains sample"),
    (4, "Verdict", "compared with recordings\nthat the model made itself"),
)
"""Below which step each stands, by number."""
BOX: Final = (0.17, 0.36)
"""Width and height, in shares of the drawing."""


def method_figure(_: Study) -> Figure:
    """Return how a recording becomes a posterior with a verdict, step by step."""
    with drawing(7.0, 1.9, fixed=True) as figure:
        axes = _canvas(figure, (0.0, 0.0, 1.0, 1.0))
        lefts = np.linspace(0.01, 0.99 - BOX[0], len(STEPS))
        for left, (name, meaning) in zip(lefts, STEPS, strict=True):
            _box(axes, left, 0.58, name, meaning, POSTERIOR)
        for left in lefts[:-1]:
            _arrow(axes, (left + BOX[0], 0.76), (left + lefts[1] - lefts[0], 0.76))
        for step, name, meaning in CHECKS:
            _box(axes, lefts[step], 0.04, name, meaning, PRIOR)
            _arrow(axes, (lefts[step] + BOX[0] / 2, 0.58), (lefts[step] + BOX[0] / 2, 0.04 + BOX[1]))
    return figure


def push_figure(_: Study) -> Figure:
    """Return a push in the wall, gated pushes over three beats, and a free-running train of pushes."""
    with drawing(7.0, 2.6, fixed=True) as figure:
        _draw_wall(_canvas(figure, (0.0, 0.0, 0.3, 1.0)))
        above = figure.add_axes((0.36, 0.6, 0.62, 0.3))
        below = figure.add_axes((0.36, 0.14, 0.62, 0.3))
        times = np.arange(BEATS)[:, None] * BEAT_S + np.array(DELAYS_S)
        _draw_beats(above, "gated: the same delays after the R peak, beat by beat; each delay is a phase")
        for gate, at in enumerate(times.T):
            above.vlines(at, 0.0, 1.0, color=SERIES[gate], lw=1.6)
            above.text(at[0], 1.05, f"gate {gate}", color=SERIES[gate], ha="center", fontsize=5.5)
        for beat in range(BEATS):
            above.text((beat + 0.69) * BEAT_S, 0.62, f"repeat {beat}", color=PRIOR, ha="left", fontsize=6.0)
        _draw_beats(below, "free-running: pushes at any instant, each with its own time after its R peak")
        below.vlines(
            np.arange(0.0, TRAIN_BEATS * BEAT_S, 1.0 / PUSHES_PER_S), 0.0, 1.0, color=POSTERIOR, lw=0.8
        )
        below.set_xlabel("time (s)")
        above.tick_params(labelbottom=False)
    return figure


def _canvas(figure: Figure, place: tuple[float, float, float, float]) -> Axes:
    axes = figure.add_axes(place)
    axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    axes.set_axis_off()
    return axes


def _box(axes: Axes, left: float, bottom: float, name: str, meaning: str, colour: str) -> None:
    look: dict[str, Any] = {"boxstyle": "round,pad=0,rounding_size=0.02", "mutation_aspect": 3.7}
    axes.add_patch(FancyBboxPatch((left, bottom), *BOX, fc="white", ec=colour, lw=1.2, **look))
    middle = left + BOX[0] / 2
    axes.text(middle, bottom + 0.27, name, ha="center", va="center", weight="bold", color=colour, fontsize=8)
    axes.text(middle, bottom + 0.12, meaning, ha="center", va="center", fontsize=5.6)


def _arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float]) -> None:
    axes.add_patch(FancyArrowPatch(start, end, arrowstyle="-|>", mutation_scale=8, color=OBSERVED, lw=0.9))


def _draw_wall(axes: Axes) -> None:
    """Draw a probe, its push into a wall, and the wave that runs along the wall."""
    axes.add_patch(Rectangle((0.32, 0.86), 0.36, 0.1, fc=PRIOR, lw=0))
    axes.text(0.5, 0.91, "probe", ha="center", va="center", color="white", fontsize=6.5)
    axes.add_patch(Rectangle((0.06, 0.3), 0.88, 0.24, fc=EXCLUDED_BACKGROUND, ec=PRIOR, lw=0.8))
    axes.text(0.08, 0.24, "heart wall", color=PRIOR, fontsize=6.5, va="center")
    axes.fill([0.4, 0.6, 0.51, 0.49], [0.86, 0.86, 0.42, 0.42], color=SERIES[4], alpha=0.5, lw=0)
    axes.text(0.63, 0.68, "push", color=SERIES[4], fontsize=7)
    for distance, strength in ((0.1, 1.0), (0.2, 0.6), (0.3, 0.35)):
        for side in (-1, 1):
            axes.plot([0.5 + side * distance] * 2, [0.32, 0.52], color=POSTERIOR, alpha=strength, lw=1.5)
    _arrow(axes, (0.66, 0.42), (0.92, 0.42))
    axes.text(
        0.5,
        0.1,
        "speed $c_s$ of the wave:\nfast where the wall is stiff",
        ha="center",
        va="center",
        fontsize=6.5,
    )


def _draw_beats(axes: Axes, title: str) -> None:
    """Draw the R peaks of some beats below what is recorded, in seconds."""
    time = np.linspace(-0.05, BEATS * BEAT_S, 1200)
    axes.plot(time, -0.75 + 0.5 * _ecg(time), color=OBSERVED, lw=0.7)
    axes.set(xlim=(time[0], time[-1]), ylim=(-1.0, 1.3), yticks=[])
    axes.set_title(title, fontsize=6.5)
    axes.spines["left"].set_visible(False)


def _ecg(time: FloatArray) -> FloatArray:
    """Return a trace with the R peak at the start of each beat, and a T wave; it is drawn, not simulated."""
    within = (time + 0.3) % BEAT_S - 0.3
    waves = (
        (0.0, 0.012, 1.0),
        (-0.025, 0.01, -0.15),
        (0.028, 0.012, -0.25),
        (-0.16, 0.025, 0.12),
        (0.3, 0.04, 0.25),
    )
    return np.asarray(sum(size * np.exp(-0.5 * ((within - at) / width) ** 2) for at, width, size in waves))
