"""The variance components of the measured speeds, with their intervals."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from swesbi.figures.style import OBSERVED, POSTERIOR, TEXT_WIDTH_IN, TRUTH, new_figure, style
from swesbi.figures.text import percent, titled
from swesbi.noise.cohort import CohortNoise
from swesbi.noise.components import ComponentEstimate
from swesbi.recording.speed import NoiseComponents

HEIGHT_IN: Final = 2.3
NAMED_SUBJECTS: Final = 30


def draw_noise(noise: CohortNoise, cohort_title: str, truth: NoiseComponents | None = None) -> Figure:
    """Draw both components: points for each recording alone, a line and a band for the whole cohort.

    Args:
        noise: The estimates.
        cohort_title: What the subjects are ("virtual volunteers").
        truth: The components that the recordings were made with, where that is known.
    """
    estimates = tuple(noise.by_subject.values())
    with style():
        figure = new_figure(TEXT_WIDTH_IN, HEIGHT_IN)
        repeat, sample = figure.subplots(1, 2)
        _panel(repeat, noise.pooled.repeat, [one.repeat for one in estimates], tuple(noise.by_subject))
        _panel(sample, noise.pooled.sample, [one.sample for one in estimates], tuple(noise.by_subject))
        repeat.set_title("(a) between repeats")
        sample.set_title("(b) between samples of a repeat")
        repeat.set_ylabel("relative sd of the speed")
        if truth is not None:
            for axes, value in ((repeat, truth.repeat_fraction), (sample, truth.sample_fraction)):
                axes.axhline(value, color=TRUTH, ls="--", label=f"made with {percent(value)}")
        for axes in (repeat, sample):
            axes.legend(loc="lower left")
        figure.suptitle(
            titled(f"Noise of the measured speeds, {percent(noise.interval)} intervals", cohort_title),
            fontsize=7.5,
        )
    return figure


def _panel(
    axes: Axes, pooled: ComponentEstimate, own: list[ComponentEstimate], names: tuple[str, ...]
) -> None:
    axes.axhspan(pooled.low, pooled.high, color=POSTERIOR, alpha=0.2, lw=0)
    axes.axhline(pooled.fraction, color=POSTERIOR, label=f"whole cohort: {100 * pooled.fraction:.1f} %")
    value = np.array([one.fraction for one in own])
    error = np.array([[one.fraction - one.low for one in own], [one.high - one.fraction for one in own]])
    axes.errorbar(np.arange(len(own)), value, error, color=OBSERVED, ls="", marker="o", ms=2.8, lw=0.8)
    if len(names) <= NAMED_SUBJECTS:
        axes.set_xticks(np.arange(len(names)), names)
    axes.set_xlabel("subject")
    axes.set_ylim(0.0, 1.12 * max(one.high for one in (*own, pooled)))
    axes.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0, symbol=" %"))
