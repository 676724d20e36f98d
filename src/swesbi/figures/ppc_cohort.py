"""Figure 2: the predictive checks of the whole cohort, one panel a subject."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.evaluation.verdict import is_exact, status, verdict_numbers
from swesbi.figures.curves import draw_fit, draw_observation, draw_predictions
from swesbi.figures.layout import columns, label_outer, mark_excluded, panel_grid, rows, shared_legend
from swesbi.figures.panels import PredictivePanel
from swesbi.figures.style import TEXT_WIDTH_IN, new_figure, style
from swesbi.figures.text import percent, titled

PANEL_HEIGHT_IN = 1.35
FRAME_HEIGHT_IN = 0.95
HEAD_ROOM = 1.15
HEAD_ROOM_OF_REASONS = 1.45
SHOWN_TESTS = 2


def draw(panels: Sequence[PredictivePanel], cohort_title: str) -> Figure:
    """Draw the predictive checks of a cohort.

    Args:
        panels: One a subject, in the order of the figure.
        cohort_title: What the subjects are ("virtual volunteers").

    Raises:
        ValueError: There is no panel.
    """
    if not panels:
        raise ValueError("no subject to draw: the cohort is empty")
    with style():
        width = TEXT_WIDTH_IN * max(1.0, columns(len(panels)) / 3)
        figure = new_figure(width, FRAME_HEIGHT_IN + PANEL_HEIGHT_IN * rows(len(panels)))
        axes = panel_grid(figure, len(panels))
        for one, panel in zip(axes, panels, strict=True):
            _draw_panel(one, panel)
        axes[0].set_xlim(0.0, 1.0)
        axes[0].set_xticks([0.0, 0.5, 1.0], ["0", "0.5", "1"])
        exact = any(is_exact(panel.support) for panel in panels)
        axes[0].set_ylim(0.0, (HEAD_ROOM_OF_REASONS if exact else HEAD_ROOM) * axes[0].get_ylim()[1])
        what = "Predictive checks, intervals of new noisy recordings" if exact else "Predictive checks"
        figure.suptitle(titled(what, cohort_title), fontsize=7.5)
        label_outer(axes, "cycle fraction $s$")
        figure.supylabel("apparent Young's modulus $E$ (kPa)", fontsize=7.0)
        shared_legend(figure, sorted(axes, key=_completeness), entries_a_row=3 if exact else 4)
    return figure


def _completeness(axes: Axes) -> int:
    """Order axes so that one with every kind of line comes first: the legend takes its order."""
    return -len(axes.get_legend_handles_labels()[1])


def _draw_panel(axes: Axes, panel: PredictivePanel) -> None:
    draw_predictions(axes, panel)
    draw_observation(axes, panel)
    draw_fit(axes, panel)
    axes.set_title(panel.subject, fontweight="bold", pad=3.0)
    axes.text(
        0.99,
        0.98,
        _note(panel),
        transform=axes.transAxes,
        ha="right",
        va="top",
        fontsize=6.0,
        linespacing=1.1,
    )
    if not panel.check.supported:
        mark_excluded(axes)


def _note(panel: PredictivePanel) -> str:
    prior, posterior = panel.check.prior.scores, panel.check.posterior.scores
    errors = f"RMSE {prior.rmse_kpa:.1f} → {posterior.rmse_kpa:.1f} kPa"
    reasons = verdict_numbers(panel.support, SHOWN_TESTS)
    if not is_exact(panel.support):
        return errors if panel.check.supported else "\n".join(["excluded", *reasons])
    lines = [status(panel.support), *reasons]
    if panel.check.supported:
        inside = panel.check.posterior.phase_scores.coverage
        lines += [errors, f"{percent(round(inside, 2))} of phases inside"]
    return "\n".join(lines)
