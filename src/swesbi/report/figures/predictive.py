"""Predictive checks: of a cohort, a panel a subject (figure 2), and of one subject, gated or free-running."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from swesbi.base.arrays import FloatArray
from swesbi.checks.cmaes import CmaesFit
from swesbi.checks.predictive import FreePredictiveCheck, PredictiveCheck
from swesbi.checks.scores import Band
from swesbi.report.figures.style import (
    CMAES,
    EXCLUDED_BACKGROUND,
    OBSERVED,
    PRIOR,
    STATUS_COLORS,
    STIFFNESS,
    TEXT_WIDTH_IN,
    color_of,
    columns,
    cycle_axis,
    draw_band,
    draw_points,
    drawing,
    few_ticks,
    from_zero,
    panel_grid,
    rows,
    shared_legend,
    titled,
)
from swesbi.report.numbers import as_percent
from swesbi.report.sheet import ShownCurve, curve_free
from swesbi.verdict.summary import is_exact, verdict_numbers
from swesbi.verdict.verdict import Verdict

SHOWN_TESTS: Final = 2


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


def draw_check(axes: Axes, panel: PredictivePanel) -> None:
    """Draw what prior and posterior predict, the recording, and the curve of the reference fit.

    A subject outside the prior's support has no posterior prediction in an experiment on features, where
    bands are those of noiseless curves, and a paler one is that of new recordings. In an experiment on speeds
    all are those of new recordings. What may not be read stands on grey.
    """
    check, grid, mass = panel.check, panel.check.target.grid, as_percent(panel.check.interval)
    new = f"{mass} of new recordings"
    within = new if is_exact(panel.verdict) else f"{mass} of curves without noise"
    draw_band(axes, grid, check.prior.curve, PRIOR, f"prior: median, {within}", line="--")
    _draw_posterior(axes, panel, 0.0, f"posterior: median, {within}", f"posterior: {new}", "CMA-ES fit")
    target = check.target
    axes.plot(grid, target.curve_kpa, color=OBSERVED, lw=0.7, zorder=1.9)
    draw_points(
        axes, target.phase, target.stiffness_kpa, target.stiffness_se_kpa, "measured ± standard error"
    )
    if not check.may_be_read:
        axes.set_facecolor(EXCLUDED_BACKGROUND)


def _draw_posterior(
    axes: Axes,
    panel: PredictivePanel,
    base: FloatArray | float,
    of_curves: str = "",
    of_new: str = "",
    of_fit: str = "",
) -> None:
    """Draw what the posterior predicts, and the curve of the reference fit, less a base (kPa)."""
    grid, predicted, color = panel.check.target.grid, panel.check.posterior, color_of(panel.verdict)
    if panel.has_posterior:
        if not is_exact(panel.verdict):
            new, face, edge = _less(predicted.observed, base), to_rgba(color, 0.13), to_rgba(color, 0.55)
            axes.fill_between(grid, new.low, new.high, facecolor=face, edgecolor=edge, lw=0.5, label=of_new)
        draw_band(axes, grid, _less(predicted.curve, base), color, of_curves)
    if panel.fit is not None:
        axes.plot(panel.fit.grid, panel.fit.curve_kpa - base, "-.", color=CMAES, lw=1.0, label=of_fit)


def draw_cohort_checks(panels: Sequence[PredictivePanel], cohort_title: str) -> Figure:
    """Draw the predictive checks of a cohort, a panel a subject in the order given."""
    width_in = TEXT_WIDTH_IN / 3 * max(3, columns(len(panels)))
    height_in = 0.95 + 1.5 * rows(len(panels))
    with drawing(width_in, height_in, titled("Predictive checks", cohort_title)) as figure:
        axes = panel_grid(figure, len(panels))
        for panel_axes, panel in zip(axes, panels, strict=True):
            draw_check(panel_axes, panel)
            panel_axes.set_title(panel.subject, fontweight="bold", pad=3.0)
            panel_axes.text(
                0.99, 0.99, _note(panel), transform=panel_axes.transAxes, ha="right", va="top", fontsize=6.0,
                color=color_of(panel.verdict),
            )  # fmt: skip
        axes[0].set_xticks([0.0, 0.5, 1.0], ["0", "0.5", "1"])
        axes[0].set(xlim=(0.0, 1.0), ylim=(0.0, 1.4 * axes[0].get_ylim()[1]))  # with room for notes
        for last in axes[columns(len(panels)) * (rows(len(panels)) - 1) :]:
            last.set_xlabel("phase of the cycle")
        figure.supylabel(STIFFNESS, fontsize=7.0)
        complete = sorted(axes, key=lambda one: -len(one.get_legend_handles_labels()[1]))
        shared_legend(figure, complete, entries_a_row=2)
    return figure


def _note(panel: PredictivePanel, between: str = "\n") -> str:
    """Return the verdict with its reasons, what is left of the prior's error, and the phases predicted."""
    prior, posterior = panel.check.prior.scores, panel.check.posterior.scores
    exact, read = is_exact(panel.verdict), panel.check.may_be_read
    lines: list[str] = [panel.verdict.status] if exact else [] if read else ["excluded"]
    if exact or not read:
        lines += list(verdict_numbers(panel.verdict, SHOWN_TESTS))
    if read:
        lines.append(f"RMSE {posterior.rmse_kpa:.1f} kPa (prior {prior.rmse_kpa:.1f})")
    if exact and read:
        number = int(panel.check.target.measured.sum())
        inside = round(panel.check.posterior.phase_coverages.observed * number)
        lines.append(f"{inside} of {number} phases inside")
    return between.join(lines)


def draw_subject_check(panel: PredictivePanel, cohort_title: str) -> Figure:
    """Draw the predictive check of one subject: curves, and their distance from the recording."""
    title = titled(f"{panel.subject}, predictive check", cohort_title)
    with drawing(6.4, 4.6, f"{title}\n{_note(panel, '; ')}", 8.0) as figure:
        curves, residuals = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.2))
        draw_check(curves, panel)
        curves.set(ylim=(0.0, None), ylabel=STIFFNESS)
        _draw_residuals(residuals, panel)
        cycle_axis(residuals)
        if not panel.check.may_be_read:
            residuals.set_facecolor(EXCLUDED_BACKGROUND)
        figure.align_ylabels([curves, residuals])
        shared_legend(figure, [curves], entries_a_row=2)
    return figure


def _draw_residuals(axes: Axes, panel: PredictivePanel) -> None:
    """Draw prediction minus observation; the prior's only where there is no posterior."""
    target = panel.check.target
    axes.axhline(0.0, color=OBSERVED, lw=0.6)
    if not panel.has_posterior:
        axes.plot(target.grid, panel.check.prior.curve.median - target.curve_kpa, "--", color=PRIOR)
    _draw_posterior(axes, panel, target.curve_kpa)
    draw_points(axes, target.phase, 0.0 * target.stiffness_kpa, target.stiffness_se_kpa)
    axes.yaxis.set_major_locator(few_ticks())
    axes.set_ylabel("predicted −\nobserved (kPa)")


def _less(band: Band, base: FloatArray | float) -> Band:
    return Band(band.median - base, band.low - base, band.high - base)


def draw_curve(axes: Axes, curve: ShownCurve, color: str) -> None:
    """Draw a recording, what prior and posterior predict, and where new measurements would lie."""
    mass = as_percent(curve.interval)
    what = "new recordings" if curve.noisy else "curves without noise"
    draw_band(axes, curve.grid, curve.prior, PRIOR, f"prior: median, {mass} of {what}", line="--")
    draw_band(axes, curve.grid, curve.posterior, color, f"posterior: median, {mass} of {what}")
    axes.vlines(
        curve.phase, curve.new.low, curve.new.high, color=color, lw=2.4, alpha=0.32,
        label=f"{mass} of new measurements",
    )  # fmt: skip
    draw_points(axes, curve.phase, curve.stiffness_kpa, curve.se_kpa, "measured ± standard error")
    cycle_axis(axes)
    axes.set_ylabel(STIFFNESS)
    from_zero(axes, curve.stiffness_kpa + curve.se_kpa, curve.new.high, curve.posterior.high)


def draw_free_check(
    subject: str, check: FreePredictiveCheck, verdict: Verdict, errors: str, cohort_title: str
) -> Figure:
    """Draw the predictive check of a free-running recording, with what its standard errors are made from."""
    curve = curve_free(check)
    inside = f"{curve.inside} of {len(curve.phase)} pushes in their {as_percent(curve.interval)} intervals"
    title = titled(f"{subject}, predictive check", cohort_title)
    with drawing(6.4, 3.8, f"{title}\n{verdict.status}; {inside}\nerrors: {errors}", 8.0) as figure:
        axes = figure.add_subplot()
        draw_curve(axes, curve, STATUS_COLORS[verdict.status])
        shared_legend(figure, [axes], entries_a_row=2)
    return figure
