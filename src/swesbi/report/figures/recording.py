"""Recordings: the variance components of their noise, and the quality-control sheet of one."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.recording.cohort.recording import UsableRecording
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.noise.components import ComponentEstimate
from swesbi.recording.samples import ACCEPTED, REASONS
from swesbi.recording.speed import NoiseComponents
from swesbi.report.figures.style import (
    CMAES,
    OBSERVED,
    POSTERIOR,
    PRIOR,
    TEXT_WIDTH_IN,
    TRUTH,
    Drawing,
    in_percent,
    new_figure,
    plain,
    style,
    titled,
)
from swesbi.report.numbers import as_percent, share

HEIGHT_IN: Final = 2.3
NAMED_SUBJECTS: Final = 30
LEGEND_ROOM: Final = 1.25
BETWEEN: Final = {
    "repeat": "between repeats",
    "sample": "between samples of a repeat",
    "sweep": "between sweeps",
}
MARKS: Final = dict(zip(REASONS, ("x", "+", "1", "2", "3", "v", "D", "s", "o"), strict=True))
COLOURS: Final = (CMAES, TRUTH, "#CC79A7", "#56B4E9", "#E69F00", "#B22222", POSTERIOR, "#6A3D9A", "#8B4513")
WITHOUT_SPEED: Final = -0.04  # below the axis of speeds, as a fraction of its height
ORIGIN_WIDTH: Final = 110
MEAN: Final[dict[str, Any]] = {
    "fmt": "o",
    "color": OBSERVED,
    "ms": 2.2,
    "elinewidth": 0.8,
    "capsize": 1.5,
    "zorder": 4,
}


def noise_figure(noise: CohortNoise, *, cohort_title: str) -> Drawing:
    """Draw the variance components, of each recording and of the cohort."""
    return draw_noise(noise, cohort_title)


def draw_noise(
    noise: CohortNoise, cohort_title: str, truth: Mapping[str, NoiseComponents] | None = None
) -> Figure:
    """Draw each component: points for each recording alone, a line and a band for each group of recordings.

    Args:
        noise: The estimates.
        cohort_title: What the subjects are ("virtual volunteers").
        truth: The components that each recording was made with, where that is known.
    """
    first = next(iter(noise.groups.values()))
    with style():
        rows = math.ceil(len(first.pooled.parts) / 2)
        figure = new_figure(TEXT_WIDTH_IN, rows * HEIGHT_IN)
        for number, name in enumerate(first.pooled.parts):
            axes = figure.add_subplot(rows, 2, number + 1)
            _panel(axes, noise, name)
            axes.set_title(f"({'abc'[number]}) {BETWEEN[name]}")
            if number % 2 == 0:
                axes.set_ylabel("relative sd of the speed")
            if truth is not None:
                made_with = [getattr(truth[subject], f"{name}_fraction") for subject in noise.group_of]
                axes.plot(made_with, ls="", marker="_", ms=9.0, color=TRUTH, label="made with")
            if name == "sweep":  # a recording has few, and its interval reaches far up and down
                axes.set_ylim(top=LEGEND_ROOM * axes.get_ylim()[1])
            axes.legend(loc="upper right" if name == "sweep" else "best")
        figure.suptitle(
            titled(f"Noise of the measured speeds, {as_percent(noise.interval)} intervals", cohort_title),
            fontsize=7.5,
        )
    return figure


def _panel(axes: Axes, noise: CohortNoise, name: str) -> None:
    """Draw one component: recordings of a group stand beside each other, over what they have together."""
    estimates: list[ComponentEstimate] = []
    start = 0
    for group, members in noise.groups.items():
        pooled, own = members.pooled.parts[name], [each.parts[name] for each in members.by_subject.values()]
        ends = np.array([start - 0.4, start + len(own) - 0.6])
        axes.fill_between(ends, pooled.low, pooled.high, color=POSTERIOR, alpha=0.2, lw=0)
        label = f"{'whole cohort' if len(noise.groups) == 1 else group}: {share(pooled.fraction)}"
        axes.plot(ends, [pooled.fraction] * 2, color=POSTERIOR, label=label)
        estimates, start = [*estimates, *own], start + len(own)
    value = np.array([estimate.fraction for estimate in estimates])
    reach = np.array([[each.fraction - each.low, each.high - each.fraction] for each in estimates]).T
    axes.errorbar(np.arange(start), value, reach, color=OBSERVED, ls="", marker="o", ms=2.8, lw=0.8)
    if start <= NAMED_SUBJECTS:
        axes.set_xticks(np.arange(start), list(noise.group_of))
    axes.set_xlabel("subject")
    highest = [group.pooled.parts[name].high for group in noise.groups.values()]
    axes.set_ylim(0.0, 1.12 * max(*highest, *(estimate.high for estimate in estimates)))
    in_percent(axes.yaxis)


def draw_recording_sheet(subject: UsableRecording, origin: str) -> Figure:
    """Draw one subject's recording; ``origin`` says where it comes from."""
    with style():
        figure = new_figure(6.4, 6.6)
        context = subject.observation.context
        who = f"{context.subject}: {context.sex}, {context.age_years:g} years, {context.hr_bpm:g} bpm"
        figure.suptitle("\n".join([who, *textwrap.wrap(plain(origin), ORIGIN_WIDTH)]), fontsize=8.0)
        speeds, stiffness, counts = figure.subplots(3, 1, sharex=True, height_ratios=(3.0, 2.0, 1.0))
        _draw_samples(speeds, subject)
        _draw_curve(stiffness, subject)
        _draw_counts(counts, subject)
        figure.legend(loc="outside lower center", ncols=4, columnspacing=1.2, handlelength=1.8)
    return figure


def _draw_samples(axes: Axes, subject: UsableRecording) -> None:
    samples, verdict, observed = subject.samples, subject.verdict, subject.observation
    phase = samples.beat_phase % 1.0
    kept = verdict == ACCEPTED
    axes.plot(phase[kept], samples.speed_m_s[kept], ".", ms=2.0, color=PRIOR, label="accepted sample")
    top = axes.get_ylim()[1]
    for index, (reason, colour) in enumerate(zip(REASONS, COLOURS, strict=True)):
        chosen = verdict == index
        if chosen.any():
            height = np.where(np.isnan(samples.speed_m_s), WITHOUT_SPEED * top, samples.speed_m_s)[chosen]
            look: dict[str, Any] = {"ms": 3.0, "mew": 0.7, "mfc": "none", "color": colour}
            axes.plot(phase[chosen], height, MARKS[reason], label=f"rejected: {reason}", **look)
    axes.axhline(0.0, color=PRIOR, lw=0.4)
    mean = (observed.phase, observed.speed_m_s, observed.speed_se_m_s)
    axes.errorbar(*mean, label="mean of a phase ± SE", **MEAN)
    axes.set(ylabel="shear-wave speed (m/s); below 0: no speed", xlim=(-0.01, 1.01))


def _draw_curve(axes: Axes, subject: UsableRecording) -> None:
    observed = subject.observation
    axes.plot(observed.grid, observed.curve_kpa, color=POSTERIOR, lw=1.0, label="curve on the analysis grid")
    axes.errorbar(observed.phase, observed.stiffness_kpa, observed.stiffness_se_kpa, **MEAN)
    missing = observed.phase[~observed.measured]
    if missing.size:
        axes.vlines(missing, *axes.get_ylim(), color=CMAES, lw=0.8, ls=":", label="missing phase")
    axes.set(ylabel="$E = 3\\rho c_s^2$ (kPa)")


def _draw_counts(axes: Axes, subject: UsableRecording) -> None:
    observed = subject.observation
    width = 0.6 / len(observed.phase)
    rejected = observed.samples_rejected.sum(axis=0)
    axes.bar(observed.phase, observed.samples_accepted, width, color=PRIOR)
    axes.bar(observed.phase, rejected, width, bottom=observed.samples_accepted, color=CMAES, label="rejected")
    axes.set(ylabel="samples", xlabel="phase of the cardiac cycle, from the R peak")
