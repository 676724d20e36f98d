"""Recordings: the variance components of their noise, and the quality-control sheet of one."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.recording.checked import Checked
from swesbi.recording.components import ComponentEstimate
from swesbi.recording.noise import CohortNoise
from swesbi.recording.samples import ACCEPTED, REASONS
from swesbi.recording.speed import NoiseComponents
from swesbi.report.figures.style import (
    CMAES,
    OBSERVED,
    POSTERIOR,
    PRIOR,
    TEXT_WIDTH_IN,
    TRUTH,
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


def draw_noise(noise: CohortNoise, cohort_title: str, truth: NoiseComponents | None = None) -> Figure:
    """Draw each component: points for each recording alone, a line and a band for the whole cohort.

    Args:
        noise: The estimates.
        cohort_title: What the subjects are ("virtual volunteers").
        truth: The components that the recordings were made with, where that is known.
    """
    made_with = {} if truth is None else asdict(truth)
    with style():
        rows = math.ceil(len(noise.pooled.parts) / 2)
        figure = new_figure(TEXT_WIDTH_IN, rows * HEIGHT_IN)
        for number, (name, pooled) in enumerate(noise.pooled.parts.items()):
            axes = figure.add_subplot(rows, 2, number + 1)
            _panel(axes, pooled, {who: one.parts[name] for who, one in noise.by_subject.items()})
            axes.set_title(f"({'abc'[number]}) {BETWEEN[name]}")
            if number % 2 == 0:
                axes.set_ylabel("relative sd of the speed")
            if (value := made_with.get(f"{name}_fraction")) is not None:
                axes.axhline(value, color=TRUTH, ls="--", label=f"made with {as_percent(value)}")
            if name == "sweep":  # a recording has few, and its interval reaches far up and down
                axes.set_ylim(top=LEGEND_ROOM * axes.get_ylim()[1])
            axes.legend(loc="upper right" if name == "sweep" else "lower left")
        figure.suptitle(
            titled(f"Noise of the measured speeds, {as_percent(noise.interval)} intervals", cohort_title),
            fontsize=7.5,
        )
    return figure


def _panel(axes: Axes, pooled: ComponentEstimate, own: Mapping[str, ComponentEstimate]) -> None:
    names, estimates = tuple(own), tuple(own.values())
    axes.axhspan(pooled.low, pooled.high, color=POSTERIOR, alpha=0.2, lw=0)
    axes.axhline(pooled.fraction, color=POSTERIOR, label=f"whole cohort: {share(pooled.fraction)}")
    value = np.array([estimate.fraction for estimate in estimates])
    error = np.array(
        [
            [estimate.fraction - estimate.low for estimate in estimates],
            [estimate.high - estimate.fraction for estimate in estimates],
        ]
    )
    axes.errorbar(np.arange(len(estimates)), value, error, color=OBSERVED, ls="", marker="o", ms=2.8, lw=0.8)
    if len(names) <= NAMED_SUBJECTS:
        axes.set_xticks(np.arange(len(names)), names)
    axes.set_xlabel("subject")
    axes.set_ylim(0.0, 1.12 * max(estimate.high for estimate in (*estimates, pooled)))
    in_percent(axes.yaxis)


def draw_recording_sheet(subject: Checked, origin: str) -> Figure:
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


def _draw_samples(axes: Axes, subject: Checked) -> None:
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


def _draw_curve(axes: Axes, subject: Checked) -> None:
    observed = subject.observation
    axes.plot(observed.grid, observed.curve_kpa, color=POSTERIOR, lw=1.0, label="curve on the analysis grid")
    axes.errorbar(observed.phase, observed.stiffness_kpa, observed.stiffness_se_kpa, **MEAN)
    missing = observed.phase[~observed.measured]
    if missing.size:
        axes.vlines(missing, *axes.get_ylim(), color=CMAES, lw=0.8, ls=":", label="missing phase")
    axes.set(ylabel="$E = 3\\rho c_s^2$ (kPa)")


def _draw_counts(axes: Axes, subject: Checked) -> None:
    observed = subject.observation
    width = 0.6 / len(observed.phase)
    rejected = observed.samples_rejected.sum(axis=0)
    axes.bar(observed.phase, observed.samples_accepted, width, color=PRIOR)
    axes.bar(observed.phase, rejected, width, bottom=observed.samples_accepted, color=CMAES, label="rejected")
    axes.set(ylabel="samples", xlabel="phase of the cardiac cycle, from the R peak")
