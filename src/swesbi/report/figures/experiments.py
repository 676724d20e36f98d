"""The experiments beside each other: RMSE, coverage and the posterior of k_ATP of every subject in each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.report.figures.style import (
    EXCLUDED_BACKGROUND,
    PRIOR,
    TEXT_WIDTH_IN,
    new_figure,
    plain_decades,
    shared_legend,
    style,
    titled,
)
from swesbi.report.numbers import as_percent

COLORS: Final = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#F0E442", "#000000")
MARKERS: Final = ("o", "s", "^", "D", "v", "P", "X", "*")
HEIGHT_IN: Final = 5.2
SLOT_IN: Final = 0.13
FRAME_WIDTH_IN: Final = 0.9
SPREAD: Final = 0.7
LONGEST_LEVEL_NAME: Final = 3


@dataclass(frozen=True)
class ExperimentScore:
    """One subject in one experiment; scores are NaN where the subject is outside the prior's support.

    Attributes:
        experiment: Its name.
        subject: Name.
        may_be_read: Whether its posterior may be interpreted.
        rmse_kpa: RMSE of the posterior predictive median on the grid.
        prior_rmse_kpa: RMSE of the prior predictive median.
        coverage_noiseless: Fraction of the grid inside the posterior's band of noiseless curves.
        coverage_observed: Fraction of the grid inside the interval of new observations.
        k_atp_per_s: Lower end of the credible interval of k_ATP, median, upper end.
        unfiltered_k_atp_per_s: Median of all candidates, where it may not be read.
    """

    experiment: str
    subject: str
    may_be_read: bool
    rmse_kpa: float
    prior_rmse_kpa: float
    coverage_noiseless: float
    coverage_observed: float
    k_atp_per_s: tuple[float, float, float]
    unfiltered_k_atp_per_s: float


def draw_experiments(
    scores: Sequence[ExperimentScore], reference: str, masses: tuple[float, float], cohort_title: str
) -> Figure:
    """Draw four panels with one column a subject and one mark an experiment.

    The last one shows k_ATP in percent of its median in the reference experiment, where both give one of the
    subject: shifts that the scale of all subjects hides.

    Args:
        scores: Every subject in every experiment, in the order of the figure.
        reference: The experiment with which the others are compared.
        masses: Probability mass of the predictive and of the credible intervals.
        cohort_title: What the subjects are ("virtual volunteers").

    Raises:
        ValueError: There is nothing to draw, or a subject comes twice in an experiment.
    """
    if not scores:
        raise ValueError("no subject to draw: the cohort is empty")
    if len({(score.experiment, score.subject) for score in scores}) < len(scores):
        raise ValueError("a subject comes twice in the same experiment")
    subjects = list(dict.fromkeys(score.subject for score in scores))
    experiments = list(dict.fromkeys(score.experiment for score in scores))
    there = {score.subject: score for score in scores if score.experiment == reference}
    with style():
        slots = len(subjects) * (len(experiments) + 1)
        figure = new_figure(max(TEXT_WIDTH_IN, FRAME_WIDTH_IN + SLOT_IN * slots), HEIGHT_IN)
        panels = figure.subplots(4, 1, sharex=True, height_ratios=(1.0, 0.8, 1.1, 0.9))
        for score in scores:
            column, which = subjects.index(score.subject), experiments.index(score.experiment)
            x = column + _offset(which, len(experiments))
            _draw_score(panels, x, which, score)
            _draw_change(panels[3], x, which, score, there.get(score.subject))
        for axes in panels:
            _shade(axes, scores, subjects, experiments)
        _name_experiments(panels[0], experiments)
        _finish(panels, subjects, masses)
        panels[3].set_ylabel(r"$k_\mathrm{ATP}$ against" + f"\n{reference.replace('_', ' ')} (%)")
        figure.suptitle(titled("Experiments beside each other", cohort_title), fontsize=7.5)
        shared_legend(figure, [panels[0], panels[2]], entries_a_row=min(3, max(2, len(experiments))))
    return figure


def _offset(which: int, experiments: int) -> float:
    """Return where an experiment's mark stands about the middle of a subject's column."""
    return SPREAD * ((which + 0.5) / experiments - 0.5)


def _draw_score(panels: Sequence[Axes], x: float, which: int, score: ExperimentScore) -> None:
    color, marker = COLORS[which % len(COLORS)], MARKERS[which % len(MARKERS)]
    panels[0].plot(
        x, score.prior_rmse_kpa, "_", color=PRIOR, ms=5.0, mew=1.0, label="prior predictive median"
    )
    if not score.may_be_read:
        panels[2].plot(
            x, score.unfiltered_k_atp_per_s, marker, color=color, mfc="none", ms=3.2, mew=0.7,
            label="excluded (grey): unfiltered median",
        )  # fmt: skip
        return
    mark: dict[str, Any] = {"color": color, "marker": marker, "ms": 3.2, "ls": "none"}
    panels[0].plot(x, score.rmse_kpa, mew=0.0, **mark)
    panels[1].plot(x, score.coverage_noiseless, mew=0.0, **mark)
    panels[1].plot(x, score.coverage_observed, mew=0.7, mfc="none", **mark)
    _draw_interval(panels[2], x, which, score.k_atp_per_s)


def _draw_change(
    axes: Axes, x: float, which: int, score: ExperimentScore, reference: ExperimentScore | None
) -> None:
    """Draw the posterior of k_ATP in percent of its median in the reference experiment."""
    if reference is None or not (score.may_be_read and reference.may_be_read):
        return
    median_there = reference.k_atp_per_s[1]
    low, median, high = (100.0 * (value / median_there - 1.0) for value in score.k_atp_per_s)
    _draw_interval(axes, x, which, (low, median, high))


def _draw_interval(axes: Axes, x: float, which: int, values: tuple[float, float, float]) -> None:
    low, median, high = values
    color, marker = COLORS[which % len(COLORS)], MARKERS[which % len(MARKERS)]
    ends = [[median - low], [high - median]]
    axes.errorbar(x, median, ends, fmt=marker, color=color, ms=3.2, mew=0.0, elinewidth=0.9, capsize=0.0)


def _name_experiments(axes: Axes, experiments: Sequence[str]) -> None:
    """Enter every experiment into the legend, one without a subject to read too."""
    for which, name in enumerate(experiments):
        color, marker = COLORS[which % len(COLORS)], MARKERS[which % len(MARKERS)]
        label = name.replace("_", " ")
        axes.plot([], [], color=color, marker=marker, ms=3.2, mew=0.0, ls="none", label=label)


def _shade(
    axes: Axes, scores: Sequence[ExperimentScore], subjects: Sequence[str], experiments: Sequence[str]
) -> None:
    """Grey the slot of every experiment without a posterior of the subject to read, and part columns."""
    half = SPREAD / len(experiments) / 2.0
    for score in scores:
        if not score.may_be_read:
            which = experiments.index(score.experiment)
            x = subjects.index(score.subject) + _offset(which, len(experiments))
            axes.axvspan(x - half, x + half, color=EXCLUDED_BACKGROUND, lw=0, zorder=0)
    for column in range(1, len(subjects)):
        axes.axvline(column - 0.5, color=PRIOR, lw=0.4, alpha=0.5, zorder=0)


def _finish(panels: Sequence[Axes], subjects: Sequence[str], masses: tuple[float, float]) -> None:
    predictive, credible = map(as_percent, masses)
    panels[0].set_ylabel("RMSE (kPa)")
    panels[1].set_ylim(-0.06, 1.06)
    panels[1].axhline(masses[0], color=PRIOR, lw=0.7, ls=":")
    panels[1].set_ylabel("coverage of\nthe grid")
    panels[1].set_title(
        f"filled: {predictive} band of noiseless curves, open: of new observations; dotted: nominal",
        fontsize=6.0, pad=2.0,
    )  # fmt: skip
    for axes in (panels[0], panels[2]):
        axes.set_yscale("log")
        plain_decades(axes.yaxis)
    panels[2].set_ylabel(r"$k_\mathrm{ATP}$ (s$^{-1}$)")
    panels[2].set_title(f"posterior median and {credible} CI", fontsize=6.0, pad=2.0)
    rotation = 90.0 if max(map(len, subjects)) > LONGEST_LEVEL_NAME else 0.0
    panels[3].axhline(0.0, color=PRIOR, lw=0.6, zorder=0)
    panels[3].set_xticks(np.arange(len(subjects)), subjects, rotation=rotation)
    panels[3].set_xlim(-0.5, len(subjects) - 0.5)
    for axes in panels:
        axes.tick_params(axis="x", length=0)
