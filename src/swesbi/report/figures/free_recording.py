"""The quality-control sheet of a free-running recording: its pushes in time and folded onto one cycle."""

from __future__ import annotations

import textwrap
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.recording.cohort.recording import UsableRecording
from swesbi.recording.observation import SOURCES
from swesbi.recording.samples import REASONS
from swesbi.report.figures.recording import COLOURS, MARKS, MEAN, ORIGIN_WIDTH, WITHOUT_SPEED
from swesbi.report.figures.style import PRIOR, new_figure, plain, style

INSTANT: Final = "instant, fraction of the push's own beat"


def draw_free_sheet(subject: UsableRecording, origin: str) -> Figure:
    """Draw one subject's free-running recording; ``origin`` says where it comes from."""
    observed = subject.observation
    with style():
        figure = new_figure(6.4, 5.4)
        context = observed.context
        who = f"{context.subject}: {context.sex}, {context.age_years:g} years, {context.hr_bpm:g} bpm"
        errors = (
            f"free-running, {int(observed.measured.sum())} pushes; errors: {SOURCES[observed.errors_from]}"
        )
        lines = [who, errors, *textwrap.wrap(plain(origin), ORIGIN_WIDTH)]
        figure.suptitle("\n".join(lines), fontsize=8.0)
        speeds, stiffness = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 2.0))
        _draw_pushes(speeds, subject)
        look: dict[str, Any] = {**MEAN, "label": None}
        stiffness.errorbar(observed.phase, observed.stiffness_kpa, observed.stiffness_se_kpa, **look)
        stiffness.set(ylabel="$E = 3\\rho c_s^2$ (kPa)", xlabel=INSTANT)
        figure.legend(loc="outside lower center", ncols=4, columnspacing=1.2, handlelength=1.8)
    return figure


def _draw_pushes(axes: Axes, subject: UsableRecording) -> None:
    samples, observed = subject.samples, subject.observation
    pushes = (observed.phase, observed.speed_m_s, observed.speed_se_m_s)
    axes.errorbar(*pushes, label="accepted push ± SE", **MEAN)
    top = axes.get_ylim()[1]
    for index, (reason, colour) in enumerate(zip(REASONS, COLOURS, strict=True)):
        chosen = subject.verdict == index
        if chosen.any():
            height = np.where(np.isnan(samples.speed_m_s), WITHOUT_SPEED * top, samples.speed_m_s)[chosen]
            look: dict[str, Any] = {"ms": 3.0, "mew": 0.7, "mfc": "none", "color": colour, "ls": "none"}
            axes.plot(samples.beat_phase[chosen], height, MARKS[reason], label=f"rejected: {reason}", **look)
    axes.axhline(0.0, color=PRIOR, lw=0.4)
    axes.set(ylabel="shear-wave speed (m/s); below 0: no speed", xlim=(-0.01, 1.01))
