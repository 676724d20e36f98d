"""One subject's predictive check: curves, residuals, scores and features."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.evaluation.scores import reduction_percent
from swesbi.evaluation.verdict import (
    is_exact,
    sampler_in_words,
    status,
    verdict_numbers,
    weights_in_words,
)
from swesbi.figures.curves import draw_fit, draw_observation, draw_predictions
from swesbi.figures.layout import mark_excluded, shared_legend
from swesbi.figures.panels import PredictivePanel
from swesbi.figures.style import (
    CMAES,
    EXCLUDED_POSTERIOR,
    OBSERVED,
    POSTERIOR,
    PRIOR,
    new_figure,
    style,
)
from swesbi.figures.text import digits, feature_label, percent, titled

SIZE_IN = (7.2, 4.4)
HEAD_ROOM = 1.05
LINE_HEIGHT = 0.047
Row = tuple[str, ...]


def draw(panel: PredictivePanel, cohort_title: str) -> Figure:
    """Draw the predictive check of one subject.

    Args:
        panel: The subject.
        cohort_title: What the subject is one of ("virtual volunteers").
    """
    with style():
        figure = new_figure(*SIZE_IN)
        grid = figure.add_gridspec(2, 2, height_ratios=(3.0, 1.2), width_ratios=(1.55, 1.0))
        curves = figure.add_subplot(grid[0, 0])
        residuals = figure.add_subplot(grid[1, 0], sharex=curves)
        _draw_curves(curves, panel)
        _draw_residuals(residuals, panel)
        _write_scores(figure.add_subplot(grid[:, 1]), panel)
        if not panel.check.supported:
            mark_excluded(curves)
            mark_excluded(residuals)
        figure.align_ylabels([curves, residuals])
        noise = ", intervals of new noisy recordings" if is_exact(panel.support) else ""
        figure.suptitle(titled(f"{panel.subject}, predictive check{noise}", cohort_title), fontsize=8.0)
        shared_legend(figure, [curves], entries_a_row=4)
    return figure


def _draw_curves(axes: Axes, panel: PredictivePanel) -> None:
    draw_predictions(axes, panel)
    draw_observation(axes, panel)
    draw_fit(axes, panel)
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, HEAD_ROOM * axes.get_ylim()[1])
    axes.tick_params(labelbottom=False)
    axes.set_ylabel("apparent Young's\nmodulus $E$ (kPa)")


def _draw_residuals(axes: Axes, panel: PredictivePanel) -> None:
    """Draw prediction minus observation; the prior's only where there is no posterior."""
    target, posterior = panel.check.target, panel.check.posterior
    grid, observed = target.grid, target.curve_kpa
    axes.axhline(0.0, color=OBSERVED, lw=0.6)
    if panel.check.supported or is_exact(panel.support):
        color = POSTERIOR if panel.check.supported else EXCLUDED_POSTERIOR
        low, high = posterior.curve.low - observed, posterior.curve.high - observed
        axes.fill_between(grid, low, high, color=color, alpha=0.25, lw=0)
        axes.plot(grid, posterior.curve.median - observed, color=color)
    else:
        axes.plot(grid, panel.check.prior.curve.median - observed, color=PRIOR, ls="--")
    axes.plot(grid, panel.fit.curve_kpa - observed, color=CMAES, ls="-.", lw=1.0)
    axes.errorbar(
        target.phase[target.measured],
        0.0 * target.phase[target.measured],
        target.stiffness_se_kpa[target.measured],
        fmt="none",
        ecolor=OBSERVED,
        elinewidth=0.7,
        capsize=1.2,
        capthick=0.6,
    )
    axes.set_xlabel("fraction of the cardiac cycle from the R peak, $s$")
    axes.set_ylabel("predicted −\nobserved (kPa)")


def _write_scores(axes: Axes, panel: PredictivePanel) -> None:
    """Write the scores as a table, then the features, then the support numbers."""
    axes.set_axis_off()
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.0)
    top = _write_table(axes, 1.0, _score_rows(panel), (0.0, 0.66, 0.83, 1.0))
    features = _feature_rows(panel)
    top = _write_table(axes, top - LINE_HEIGHT, features, (0.0, 0.60, 0.66, 1.0))
    lines: list[Row] = [(line,) for line in _verdict_lines(panel)]
    _write_table(axes, top - LINE_HEIGHT, lines, (0.0,))


def _verdict_lines(panel: PredictivePanel) -> list[str]:
    support = panel.support
    if is_exact(support):
        made = [f"draws by {sampler_in_words(support)}", f"  {weights_in_words(support)}"]
        return [f"verdict: {status(support)}", *verdict_numbers(support), *made]
    words = "within prior support" if panel.check.supported else "excluded: outside prior support"
    return [words, *verdict_numbers(support), f"  in {feature_label(support.worst_component)}"]


def _score_rows(panel: PredictivePanel) -> list[Row]:
    prior, posterior = panel.check.prior, panel.check.posterior
    reduction = reduction_percent(prior.scores.rmse_kpa, posterior.scores.rmse_kpa)
    inside = f"{percent(panel.check.interval)} PI coverage"
    return [
        ("", "prior", "post.", "CMA-ES"),
        ("RMSE (kPa)", *_numbers(2, prior.scores.rmse_kpa, posterior.scores.rmse_kpa, panel.fit.rmse_kpa)),
        ("  reduction (%)", "", *_numbers(1, reduction), ""),
        ("NRMSE", *_numbers(3, prior.scores.nrmse, posterior.scores.nrmse), ""),
        ("$R^2$", *_numbers(3, prior.scores.r2, posterior.scores.r2), ""),
        (
            "post-peak RMSE (kPa)",
            *_numbers(2, prior.scores.post_peak_rmse_kpa, posterior.scores.post_peak_rmse_kpa),
            "",
        ),
        (f"{inside}, grid", *_numbers(2, prior.scores.coverage, posterior.scores.coverage), ""),
        ("  measured phases", *_numbers(2, prior.phase_scores.coverage, posterior.phase_scores.coverage), ""),
        (
            "  measurement noise alone" if is_exact(panel.support) else "  with recording noise",
            *_numbers(2, prior.coverage_recording_noise, posterior.coverage_recording_noise),
            "",
        ),
    ]


def _feature_rows(panel: PredictivePanel) -> list[Row]:
    """Compare observed features with the posterior's intervals, the prior's where there is no posterior."""
    check = panel.check
    which, name = (check.posterior, "posterior") if check.supported else (check.prior, "prior")
    features = which.features
    rows: list[Row] = [("feature, observed", "", "", f"{name} {percent(panel.check.interval)} PI")]
    for j, label in enumerate(check.target.feature_names):
        low, high = features.predicted.low[j], features.predicted.high[j]
        mark = "in" if features.inside[j] else "out"
        rows.append(
            (
                feature_label(label),
                digits(features.observed[j]),
                "",
                f"{mark} [{digits(low)}, {digits(high)}]",
            )
        )
    return rows


def _numbers(digits: int, *values: float) -> Row:
    """Format numbers with a true minus; a dash where there is none."""
    return tuple("–" if value != value else f"{value:.{digits}f}".replace("-", "−") for value in values)


def _write_table(axes: Axes, top: float, rows: list[Row], columns: tuple[float, ...]) -> float:
    """Write rows of text from ``top`` down: first column left, others right-aligned; return the new top."""
    for row in rows:
        for place, (x, cell) in enumerate(zip(columns, row, strict=True)):
            if cell:
                axes.text(x, top, cell, ha="right" if place else "left", va="top", fontsize=6.5)
        top -= LINE_HEIGHT
    return top
