"""The quality-control sheet of a free-running recording: its pushes in time and folded onto one cycle."""

from __future__ import annotations

import textwrap
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.arrays import FloatArray
from swesbi.recording.check import CheckedFree
from swesbi.recording.events import CLOSES_MS, in_words
from swesbi.recording.free_noise import SOURCES
from swesbi.recording.free_observation import FreeObservation
from swesbi.recording.free_samples import FreeSamples
from swesbi.recording.samples import REASONS
from swesbi.show.figures.recording import COLOURS, MARKS, MEAN, ORIGIN_WIDTH, WITHOUT_SPEED
from swesbi.show.figures.style import PRIOR, new_figure, style

INSTANT: Final = "instant, fraction of the push's own beat"
WITH_WAVES: Final = f"{INSTANT}; natural waves have none, and stand amid where their valve can close"


def draw_free_sheet(subject: CheckedFree, origin: str) -> Figure:
    """Draw one subject's free-running recording; ``origin`` says where it comes from."""
    observed = subject.observation
    with style():
        figure = new_figure(6.4, 5.4)
        context = observed.context
        who = f"{context.subject}: {context.sex}, {context.age_years:g} years, {context.hr_bpm:g} bpm"
        counts = ", ".join(filter(None, [f"{int(observed.is_push.sum())} pushes", in_words(observed.event)]))
        errors = f"free-running, {counts}; errors: {SOURCES[observed.noise_source]}"
        lines = [who, errors, *textwrap.wrap(origin, ORIGIN_WIDTH)]
        figure.suptitle("\n".join(lines), fontsize=8.0)
        speeds, stiffness = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 2.0))
        _draw_pushes(speeds, subject)
        relative = observed.relative_se
        look: dict[str, Any] = {**MEAN, "label": None}
        stiffness.errorbar(
            _place(observed), observed.stiffness_kpa, 2.0 * relative * observed.stiffness_kpa, **look
        )
        stiffness.set(
            ylabel="$E = 3\\rho c_s^2$ (kPa)", xlabel=INSTANT if observed.is_push.all() else WITH_WAVES
        )
        figure.legend(loc="outside lower center", ncols=4, columnspacing=1.2, handlelength=1.8)
    return figure


def _draw_pushes(axes: Axes, subject: CheckedFree) -> None:
    samples, observed = subject.samples, subject.observation
    error = observed.relative_se * observed.speed_m_s
    what = "push" if observed.is_push.all() else "speed"
    axes.errorbar(_place(observed), observed.speed_m_s, error, label=f"accepted {what} ± SE", **MEAN)
    top = axes.get_ylim()[1]
    for index, (reason, colour) in enumerate(zip(REASONS, COLOURS, strict=True)):
        chosen = subject.verdict == index
        if chosen.any():
            height = np.where(np.isnan(samples.speed_m_s), WITHOUT_SPEED * top, samples.speed_m_s)[chosen]
            look: dict[str, Any] = {"ms": 3.0, "mew": 0.7, "mfc": "none", "color": colour, "ls": "none"}
            axes.plot(_place(samples)[chosen], height, MARKS[reason], label=f"rejected: {reason}", **look)
    axes.axhline(0.0, color=PRIOR, lw=0.4)
    axes.set(ylabel="shear-wave speed (m/s); below 0: no speed", xlim=(-0.01, 1.01))


def _place(recorded: FreeSamples | FreeObservation) -> FloatArray:
    """Return where rows are drawn: natural waves, which have no instant, amid where their valve can close."""
    place = recorded.phase.copy()
    for event, (low, high) in CLOSES_MS.items():
        waves = recorded.event == event
        place[waves] = (0.5 * (low + high) / recorded.rr_ms)[waves]
    return place
