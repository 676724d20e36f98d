"""Recordings: the variance components of their noise, and the quality-control sheet of one."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.recording.cohort.observed import UsableRecording
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import SOURCES
from swesbi.recording.samples import ACCEPTED, REASONS
from swesbi.recording.speed import NoiseComponents
from swesbi.report.figures.forest import ENDS, MOST_ROWS, Panel, Series, forest
from swesbi.report.figures.style import (
    ACCEPTED_COLOR,
    EXCLUDED_POSTERIOR,
    INSTANT,
    OBSERVED,
    PHASE,
    POSTERIOR,
    PRIOR,
    REFUSED_COLOR,
    SERIES,
    SPEED,
    STIFFNESS,
    TRUTH,
    Drawing,
    draw_points,
    drawing,
    plain,
    shared_legend,
    titled,
)
from swesbi.report.numbers import as_percent, share
from swesbi.report.sheet import in_words

COMPONENTS: Final = {
    "repeat": "between repeats",
    "sample": "between samples of a repeat",
    "sweep": "between sweeps",
}
LOOK: Final = {
    "alone": Series(OBSERVED, "a recording alone", lane="all"),
    "truth": Series(TRUTH, "made with", marker="|", lane="all", filled=False, size=7.0),
}
MARKS: Final = ("x", "+", "1", "2", "3", "v", "D", "s", "o")
WITHOUT_SPEED: Final = -0.04  # below the axis of speeds, as a fraction of its height
ORIGIN_WIDTH: Final = 110


def noise_figure(
    noise: CohortNoise, *, cohort_title: str, truth: Mapping[str, NoiseComponents] | None = None
) -> Drawing:
    """Draw a panel a component: each recording alone, over what those of its group have together.

    ``truth`` are the components that each recording was made with, where that is known.
    """
    names = [*noise.group_of][:MOST_ROWS]
    rows = pd.DataFrame(_noise_rows(noise, truth or {}), columns=["row", "panel", "series", *ENDS])
    panels = {
        name: Panel(_component_title(noise, name), "relative sd of the speed", "percent")
        for name in next(iter(noise.groups.values())).pooled.parts
    }

    def groups(axes: Axes, name: str) -> None:
        for each in noise.groups.values():
            places = [names.index(subject) for subject in each.by_subject if subject in names]
            if places:
                pooled, ends = each.pooled.parts[name], (min(places) - 0.4, max(places) + 0.4)
                axes.fill_betweenx(
                    ends, pooled.low, pooled.high, color=POSTERIOR, alpha=0.2, lw=0,
                    label="recordings of a group together",
                )  # fmt: skip
                axes.vlines(pooled.fraction, *ends, color=POSTERIOR, lw=1.1)
        axes.set_xlim(left=0.0)

    title = titled(f"Noise of the measured speeds, {as_percent(noise.interval)} intervals", cohort_title)
    return forest(rows, panels, LOOK, title=title, names=dict(zip(names, names, strict=True)), behind=groups)


def _component_title(noise: CohortNoise, name: str) -> str:
    """Return which component it is, and what the recordings of each group have together."""
    shares = {group: share(each.pooled.parts[name].fraction) for group, each in noise.groups.items()}
    told = ", ".join(f"{plain(group)} {value}" for group, value in shares.items())
    return f"{COMPONENTS[name]}\n{next(iter(shares.values())) if len(shares) == 1 else told}"


def _noise_rows(noise: CohortNoise, truth: Mapping[str, NoiseComponents]) -> Iterator[tuple[object, ...]]:
    for group in noise.groups.values():
        for subject, own in group.by_subject.items():
            for name, part in own.parts.items():
                yield subject, name, "alone", part.low, part.fraction, part.high
                if subject in truth:
                    true = getattr(truth[subject], f"{name}_fraction")
                    yield subject, name, "truth", true, true, true


def draw_recording_sheet(subject: UsableRecording, origin: str) -> Figure:
    """Draw one subject's recording: speeds with what is rejected, stiffness, and counts of a gated one."""
    observed, context = subject.observation, subject.observation.context
    heights = (3.0, 2.0, 1.2) if observed.is_gated else (3.0, 2.0)
    lines = [f"{context.subject}: {context.sex}, {context.age_years:g} years, {context.hr_bpm:g} bpm"]
    if not observed.is_gated:
        pushes = int(observed.measured.sum())
        lines.append(f"free-running, {pushes} pushes; errors: {SOURCES[observed.errors_from]}")
    title = "\n".join([*lines, *textwrap.wrap(plain(origin), ORIGIN_WIDTH)])
    with drawing(6.4, 1.0 + 0.9 * sum(heights), title, 8.0) as figure:
        axes = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
        _draw_speeds(axes[0], subject)
        _draw_stiffness(axes[1], subject)
        if observed.is_gated:
            _draw_counts(axes[2], subject)
        axes[-1].set(xlabel=PHASE if observed.is_gated else INSTANT, xlim=(-0.01, 1.01))
        figure.align_ylabels(list(axes))
        shared_legend(figure, list(axes), entries_a_row=4)
    return figure


def _draw_speeds(axes: Axes, subject: UsableRecording) -> None:
    """Draw accepted speeds, and below or among them what was rejected, by reason."""
    samples, verdict, observed = subject.samples, subject.verdict, subject.observation
    phase = samples.beat_phase % 1.0 if observed.is_gated else samples.beat_phase
    if observed.is_gated:
        kept = verdict == ACCEPTED
        axes.plot(phase[kept], samples.speed_m_s[kept], ".", ms=2.0, color=PRIOR, label="accepted sample")
    what = "mean of a phase ± standard error" if observed.is_gated else "accepted push ± standard error"
    draw_points(axes, observed.phase, observed.speed_m_s, observed.speed_se_m_s, what)
    below, lanes = WITHOUT_SPEED * axes.get_ylim()[1], 0
    for index, (reason, mark, colour) in enumerate(zip(REASONS, MARKS, SERIES, strict=True)):
        chosen = verdict == index
        if chosen.any():
            missing = np.isnan(samples.speed_m_s)
            lanes += bool((missing & chosen).any())  # each reason on a line of its own
            height = np.where(missing, lanes * below, samples.speed_m_s)[chosen]
            label = f"rejected: {in_words(reason)}"
            axes.plot(
                phase[chosen], height, mark, ms=3.0, mew=0.7, mfc="none", color=colour, ls="none", label=label
            )
    axes.axhline(0.0, color=PRIOR, lw=0.4)
    axes.set_ylabel(f"{SPEED};\nbelow 0: none measured")


def _draw_stiffness(axes: Axes, subject: UsableRecording) -> None:
    """Draw the stiffness with standard errors; of a gated recording also the curve through its phases."""
    observed = subject.observation
    if observed.is_gated:
        curve = "curve on the analysis grid"
        axes.plot(observed.grid, observed.curve_kpa, color=POSTERIOR, lw=1.0, label=curve)
        for at in observed.phase[~observed.measured]:
            axes.axvline(at, color=EXCLUDED_POSTERIOR, lw=0.8, ls=":", label="phase without a measurement")
    draw_points(axes, observed.phase, observed.stiffness_kpa, observed.stiffness_se_kpa)
    axes.set_ylabel(STIFFNESS)


def _draw_counts(axes: Axes, subject: UsableRecording) -> None:
    observed = subject.observation
    width, accepted = 0.6 / len(observed.phase), observed.samples_accepted
    rejected = observed.samples_rejected.sum(axis=0)
    axes.bar(observed.phase, accepted, width, color=ACCEPTED_COLOR, label="samples accepted")
    axes.bar(observed.phase, rejected, width, bottom=accepted, color=REFUSED_COLOR, label="samples rejected")
    axes.set_ylabel("samples")
