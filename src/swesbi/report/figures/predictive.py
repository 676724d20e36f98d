"""Predictive checks: of a cohort, a panel a subject (figure 2), and of one subject, gated or free-running."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.base.arrays import FloatArray
from swesbi.checks.cmaes import CmaesFit
from swesbi.checks.free_predictive import FreePredictiveCheck
from swesbi.checks.predictive import PredictiveCheck
from swesbi.checks.scores import Band
from swesbi.report.figures.band import (
    STIFFNESS,
    cycle_axis,
    draw_band,
    draw_new_points,
    draw_outer_band,
    draw_points,
    from_zero,
)
from swesbi.report.figures.style import (
    CMAES,
    OBSERVED,
    PRIOR,
    STATUS_COLORS,
    TEXT_WIDTH_IN,
    color_of,
    columns,
    few_ticks,
    mark_excluded,
    new_figure,
    panel_grid,
    rows,
    shared_legend,
    style,
    titled,
)
from swesbi.report.numbers import as_percent
from swesbi.report.sheet import ShownCurve, curve_free
from swesbi.verdict.summary import is_exact, verdict_numbers
from swesbi.verdict.verdict import Verdict

PANEL_IN: Final = (TEXT_WIDTH_IN / 3, 1.5)
FRAME_HEIGHT_IN: Final = 0.95
ROOM_FOR_NOTES: Final = 1.4
SHOWN_TESTS: Final = 2
SUBJECT_IN: Final = (6.4, 4.6)
FREE_IN: Final = (6.4, 3.8)


@dataclass(frozen=True)
class PredictivePanel:
    """One subject's predictive check, reference fit, if one was made, and verdict."""

    subject: str
    check: PredictiveCheck
    fit: CmaesFit | None
    verdict: Verdict

    @property
    def has_posterior(self) -> bool:
        """Whether there are predictions of a posterior, be they contradicted."""
        return self.check.may_be_read or is_exact(self.verdict)

    @property
    def color(self) -> str:
        """The colour of the posterior."""
        return color_of(self.verdict)


def draw_check(axes: Axes, panel: PredictivePanel) -> None:
    """Draw what prior and posterior predict, the recording, and the curve of the reference fit.

    A subject outside the prior's support has no posterior prediction in an experiment on features, where
    bands are those of noiseless curves, and a paler one is that of new recordings. In an experiment on speeds
    all are those of new recordings.
    """
    check, grid, mass = panel.check, panel.check.target.grid, as_percent(panel.check.interval)
    new = f"{mass} of new recordings"
    within = new if is_exact(panel.verdict) else f"{mass} of curves without noise"
    draw_band(axes, grid, check.prior.curve, PRIOR, f"prior: median, {within}", line="--")
    if panel.has_posterior:
        if not is_exact(panel.verdict):
            draw_outer_band(axes, grid, check.posterior.observed, panel.color, f"posterior: {new}")
        draw_band(axes, grid, check.posterior.curve, panel.color, f"posterior: median, {within}")
    target = check.target
    axes.plot(grid, target.curve_kpa, color=OBSERVED, lw=0.7, zorder=1.9)
    draw_points(
        axes, target.phase, target.stiffness_kpa, target.stiffness_se_kpa, "measured ± standard error"
    )
    if panel.fit is not None:
        axes.plot(panel.fit.grid, panel.fit.curve_kpa, "-.", color=CMAES, lw=1.0, label="CMA-ES fit")


def draw_cohort_checks(panels: Sequence[PredictivePanel], cohort_title: str) -> Figure:
    """Draw the predictive checks of a cohort.

    Args:
        panels: One a subject, in the order of the figure.
        cohort_title: What the subjects are ("virtual volunteers").

    Raises:
        ValueError: There is no panel.
    """
    if not panels:
        raise ValueError("no subject to draw: the cohort is empty")
    width, height = PANEL_IN
    with style():
        across = max(3, columns(len(panels)))
        figure = new_figure(width * across, FRAME_HEIGHT_IN + height * rows(len(panels)))
        axes = panel_grid(figure, len(panels))
        for panel_axes, panel in zip(axes, panels, strict=True):
            draw_check(panel_axes, panel)
            panel_axes.set_title(panel.subject, fontweight="bold", pad=3.0)
            look: dict[str, Any] = {"ha": "right", "va": "top", "fontsize": 6.0, "color": panel.color}
            panel_axes.text(0.99, 0.99, _note(panel), transform=panel_axes.transAxes, **look)
            if not panel.check.may_be_read:
                mark_excluded(panel_axes)
        axes[0].set_xlim(0.0, 1.0)
        axes[0].set_xticks([0.0, 0.5, 1.0], ["0", "0.5", "1"])
        axes[0].set_ylim(0.0, ROOM_FOR_NOTES * axes[0].get_ylim()[1])
        figure.suptitle(titled("Predictive checks", cohort_title), fontsize=7.5)
        for last in axes[columns(len(panels)) * (rows(len(panels)) - 1) :]:
            last.set_xlabel("phase of the cycle")
        figure.supylabel(STIFFNESS, fontsize=7.0)
        complete = sorted(axes, key=lambda one: -len(one.get_legend_handles_labels()[1]))
        shared_legend(figure, complete, entries_a_row=2)
    return figure


def _note(panel: PredictivePanel, between: str = "\n") -> str:
    """Return the verdict with its reasons, and what is left of the prior's error."""
    prior, posterior = panel.check.prior.scores, panel.check.posterior.scores
    exact, read = is_exact(panel.verdict), panel.check.may_be_read
    lines: list[str] = [panel.verdict.status] if exact else [] if read else ["excluded"]
    if exact or not read:
        lines += list(verdict_numbers(panel.verdict, SHOWN_TESTS))
    if read:
        lines.append(f"RMSE {posterior.rmse_kpa:.1f} kPa (prior {prior.rmse_kpa:.1f})")
    if exact and read:
        lines.append(_inside(panel))
    return between.join(lines)


def _inside(panel: PredictivePanel) -> str:
    """Return how many of the measured phases lie in the interval of a new recording."""
    number = int(panel.check.target.measured.sum())
    return f"{round(panel.check.posterior.phase_coverages.observed * number)} of {number} phases inside"


def draw_subject_check(panel: PredictivePanel, cohort_title: str) -> Figure:
    """Draw the predictive check of one subject: curves, and their distance from the recording.

    Args:
        panel: The subject.
        cohort_title: What the subject is one of ("virtual volunteers").
    """
    with style():
        figure = new_figure(*SUBJECT_IN)
        curves, residuals = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.2))
        draw_check(curves, panel)
        curves.set_ylim(bottom=0.0)
        curves.set_ylabel(STIFFNESS)
        _draw_residuals(residuals, panel)
        cycle_axis(residuals)
        if not panel.check.may_be_read:
            mark_excluded(curves)
            mark_excluded(residuals)
        figure.align_ylabels([curves, residuals])
        title = titled(f"{panel.subject}, predictive check", cohort_title)
        figure.suptitle(f"{title}\n{_note(panel, '; ')}", fontsize=8.0)
        shared_legend(figure, [curves], entries_a_row=2)
    return figure


def _draw_residuals(axes: Axes, panel: PredictivePanel) -> None:
    """Draw prediction minus observation; the prior's only where there is no posterior."""
    target, posterior = panel.check.target, panel.check.posterior
    grid, observed = target.grid, target.curve_kpa
    axes.axhline(0.0, color=OBSERVED, lw=0.6)
    if panel.has_posterior:
        if not is_exact(panel.verdict):
            draw_outer_band(axes, grid, _less(posterior.observed, observed), panel.color)
        draw_band(axes, grid, _less(posterior.curve, observed), panel.color)
    else:
        axes.plot(grid, panel.check.prior.curve.median - observed, "--", color=PRIOR)
    if panel.fit is not None:
        axes.plot(grid, panel.fit.curve_kpa - observed, "-.", color=CMAES, lw=1.0)
    draw_points(axes, target.phase, 0.0 * target.stiffness_kpa, target.stiffness_se_kpa)
    axes.yaxis.set_major_locator(few_ticks())
    axes.set_ylabel("predicted −\nobserved (kPa)")


def _less(band: Band, observed: FloatArray) -> Band:
    return Band(band.median - observed, band.low - observed, band.high - observed)


def draw_curve(axes: Axes, curve: ShownCurve, color: str) -> None:
    """Draw a recording, what prior and posterior predict, and where new measurements would lie.

    Args:
        axes: Where to draw.
        curve: Gated or free-running.
        color: Of the posterior.
    """
    mass = as_percent(curve.interval)
    what = "new recordings" if curve.noisy else "curves without noise"
    draw_band(axes, curve.grid, curve.prior, PRIOR, f"prior: median, {mass} of {what}", line="--")
    draw_band(axes, curve.grid, curve.posterior, color, f"posterior: median, {mass} of {what}")
    draw_new_points(axes, curve.phase, curve.new, color, f"{mass} of new measurements")
    draw_points(axes, curve.phase, curve.stiffness_kpa, curve.se_kpa, "measured ± standard error")
    cycle_axis(axes)
    axes.set_ylabel(STIFFNESS)
    from_zero(axes, curve.stiffness_kpa + curve.se_kpa, curve.new.high, curve.posterior.high)


def draw_free_check(
    subject: str, check: FreePredictiveCheck, verdict: Verdict, errors: str, cohort_title: str
) -> Figure:
    """Draw the predictive check of a free-running recording.

    Args:
        subject: Name.
        check: The check.
        verdict: What is said of the subject.
        errors: What the standard errors are computed from.
        cohort_title: What the subject is one of ("virtual volunteers").
    """
    curve = curve_free(check)
    with style():
        figure = new_figure(*FREE_IN)
        axes = figure.add_subplot()
        draw_curve(axes, curve, STATUS_COLORS[verdict.status])
        inside = (
            f"{curve.inside} of {len(curve.phase)} pushes in their {as_percent(curve.interval)} intervals"
        )
        title = titled(f"{subject}, predictive check", cohort_title)
        figure.suptitle("\n".join([title, f"{verdict.status}; {inside}", f"errors: {errors}"]), fontsize=8.0)
        shared_legend(figure, [axes], entries_a_row=2)
    return figure
