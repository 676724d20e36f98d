"""Predictive checks: of a cohort, one panel a subject (figure 2), and of one subject with its scores."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from numpy.typing import NDArray

from swesbi.checks.cmaes import CmaesFit
from swesbi.checks.predictive import Prediction, PredictiveCheck
from swesbi.checks.scores import Band, reduction_percent
from swesbi.posterior.result import ExactPosterior
from swesbi.report.figures.style import (
    CMAES,
    EXCLUDED_POSTERIOR,
    OBSERVED,
    POSTERIOR,
    PRIOR,
    TEXT_WIDTH_IN,
    columns,
    label_outer,
    mark_excluded,
    new_figure,
    panel_grid,
    rows,
    shared_legend,
    style,
    titled,
)
from swesbi.report.numbers import as_percent, digits, feature_label
from swesbi.verdict.summary import is_exact, sampler_in_words, verdict_numbers, weights_in_words
from swesbi.verdict.verdict import Verdict

FloatArray = NDArray[np.float64]
PANEL_HEIGHT_IN = 1.35
FRAME_HEIGHT_IN = 0.95
COHORT_HEAD_ROOM = 1.15
HEAD_ROOM_OF_REASONS = 1.45
SHOWN_TESTS = 2
SIZE_IN = (7.2, 4.4)
HEAD_ROOM = 1.05
LINE_HEIGHT = 0.047
ERROR_BAR: Final[dict[str, Any]] = {"elinewidth": 0.7, "capsize": 1.2, "capthick": 0.6}
Row = tuple[str, ...]


@dataclass(frozen=True)
class PredictivePanel:
    """One subject's predictive check, reference fit, if one was made, and verdict."""

    subject: str
    check: PredictiveCheck
    fit: CmaesFit | None
    verdict: Verdict


@dataclass(frozen=True)
class PosteriorPanel:
    """One subject's posterior.

    Attributes:
        subject: Name.
        theta: (n, 3) draws within the prior's bounds; shown only where they may be interpreted.
        unfiltered: (m, 3) candidates as they came, shown where it is not.
        fit_theta: (3,) the CMA-ES reference fit.
        verdict: The verdict.
    """

    subject: str
    theta: FloatArray
    unfiltered: FloatArray
    fit_theta: FloatArray
    verdict: Verdict


NETWORK_ALONE: Final = "network alone"


@dataclass(frozen=True)
class ExactPanel:
    """One subject's exact posterior.

    Attributes:
        subject: Name.
        result: Draws, the network's draws, and how reliable they are.
        fit_theta: (3,) the CMA-ES reference fit, if one was made; else None.
        verdict: The verdict.
        truth: (3,) active parameters that made the recording, of a generated cohort; else None.
        start: What the draws are with which the inference began.
    """

    subject: str
    result: ExactPosterior
    fit_theta: FloatArray | None
    verdict: Verdict
    truth: FloatArray | None
    start: str = NETWORK_ALONE


def draw_predictions(axes: Axes, panel: PredictivePanel) -> None:
    """Draw prior and posterior predictive medians, bands of noiseless curves, and the interval with noise.

    A subject outside the prior's support has no posterior prediction in an experiment on features. A
    contradicted one has a grey one in an experiment on speeds. There the intervals are those of new
    recordings, and the only ones shown.
    """
    check, exact = panel.check, is_exact(panel.verdict)
    grid = check.target.grid
    mass = as_percent(check.interval)
    label = f"noisy {mass} PI" if exact else f"{mass} band, noiseless"
    _draw_band(axes, grid, check.prior.curve, PRIOR, "--", ("prior median", f"prior {label}"))
    if check.may_be_read:
        names = ("posterior median", f"posterior {label}")
        if not exact:
            _draw_observed(axes, grid, check.posterior.observed, f"posterior {mass} PI, with noise")
        _draw_band(axes, grid, check.posterior.curve, POSTERIOR, "-", names)
    elif exact:
        names = ("contradicted: median", f"contradicted: {label}")
        _draw_band(axes, grid, check.posterior.curve, EXCLUDED_POSTERIOR, "-", names)


def draw_observation(axes: Axes, panel: PredictivePanel) -> None:
    """Draw the observed curve and the measured phases with their standard errors."""
    target = panel.check.target
    axes.plot(target.grid, target.curve_kpa, color=OBSERVED, lw=0.7, label="observed curve", zorder=1.9)
    phase, se = target.phase[target.measured], target.stiffness_se_kpa[target.measured]
    mark: dict[str, Any] = {"fmt": "o", "color": OBSERVED, "ms": 2.0, "label": "measured ± SE", "zorder": 4}
    axes.errorbar(phase, target.stiffness_kpa[target.measured], se, **mark, **ERROR_BAR)


def draw_fit(axes: Axes, panel: PredictivePanel) -> None:
    """Draw the curve of the CMA-ES reference fit, if one was made."""
    if panel.fit is None:
        return
    axes.plot(panel.fit.grid, panel.fit.curve_kpa, color=CMAES, ls="-.", lw=1.0, label="CMA-ES best fit")


def _draw_band(
    axes: Axes, grid: FloatArray, values: Band, color: str, linestyle: str, labels: tuple[str, str]
) -> None:
    axes.plot(grid, values.median, color=color, ls=linestyle, label=labels[0])
    axes.fill_between(grid, values.low, values.high, color=color, alpha=0.25, lw=0, label=labels[1])


def _draw_observed(axes: Axes, grid: FloatArray, values: Band, label: str) -> None:
    """Draw the interval of new observations: lighter than the band of noiseless curves, with an edge."""
    look: dict[str, Any] = {"facecolor": to_rgba(POSTERIOR, 0.13), "edgecolor": to_rgba(POSTERIOR, 0.55)}
    axes.fill_between(grid, values.low, values.high, lw=0.5, label=label, **look)


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
    with style():
        width = TEXT_WIDTH_IN * max(1.0, columns(len(panels)) / 3)
        figure = new_figure(width, FRAME_HEIGHT_IN + PANEL_HEIGHT_IN * rows(len(panels)))
        axes = panel_grid(figure, len(panels))
        for panel_axes, panel in zip(axes, panels, strict=True):
            _draw_panel(panel_axes, panel)
        axes[0].set_xlim(0.0, 1.0)
        axes[0].set_xticks([0.0, 0.5, 1.0], ["0", "0.5", "1"])
        exact = any(is_exact(panel.verdict) for panel in panels)
        axes[0].set_ylim(0.0, (HEAD_ROOM_OF_REASONS if exact else COHORT_HEAD_ROOM) * axes[0].get_ylim()[1])
        what = "Predictive checks, intervals of new noisy recordings" if exact else "Predictive checks"
        figure.suptitle(titled(what, cohort_title), fontsize=7.5)
        label_outer(axes, "cycle fraction $s$")
        figure.supylabel("apparent Young's modulus $E$ (kPa)", fontsize=7.0)
        shared_legend(figure, sorted(axes, key=_completeness), entries_a_row=3)
    return figure


def _completeness(axes: Axes) -> int:
    """Order axes so that one with every kind of line comes first: the legend takes its order."""
    return -len(axes.get_legend_handles_labels()[1])


def _draw_panel(axes: Axes, panel: PredictivePanel) -> None:
    draw_predictions(axes, panel)
    draw_observation(axes, panel)
    draw_fit(axes, panel)
    axes.set_title(panel.subject, fontweight="bold", pad=3.0)
    look: dict[str, Any] = {"ha": "right", "va": "top", "fontsize": 6.0, "linespacing": 1.1}
    axes.text(0.99, 0.98, _note(panel), transform=axes.transAxes, **look)
    if not panel.check.may_be_read:
        mark_excluded(axes)


def _note(panel: PredictivePanel) -> str:
    prior, posterior = panel.check.prior.scores, panel.check.posterior.scores
    errors = f"RMSE {prior.rmse_kpa:.1f} → {posterior.rmse_kpa:.1f} kPa"
    reasons = verdict_numbers(panel.verdict, SHOWN_TESTS)
    if not is_exact(panel.verdict):
        return errors if panel.check.may_be_read else "\n".join(["excluded", *reasons])
    lines = [panel.verdict.status, *reasons]
    if panel.check.may_be_read:
        inside = panel.check.posterior.phase_scores.coverage
        lines += [errors, f"{as_percent(round(inside, 2))} of phases in PI"]
    return "\n".join(lines)


def draw_subject_check(panel: PredictivePanel, cohort_title: str) -> Figure:
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
        if not panel.check.may_be_read:
            mark_excluded(curves)
            mark_excluded(residuals)
        figure.align_ylabels([curves, residuals])
        noise = ", intervals of new noisy recordings" if is_exact(panel.verdict) else ""
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
    if panel.check.may_be_read or is_exact(panel.verdict):
        color = POSTERIOR if panel.check.may_be_read else EXCLUDED_POSTERIOR
        wider = Band(*(values - observed for values in vars(posterior.observed).values()))
        if not is_exact(panel.verdict):
            _draw_observed(axes, grid, wider, "")
        low, high = posterior.curve.low - observed, posterior.curve.high - observed
        axes.fill_between(grid, low, high, color=color, alpha=0.25, lw=0)
        axes.plot(grid, posterior.curve.median - observed, color=color)
    else:
        axes.plot(grid, panel.check.prior.curve.median - observed, color=PRIOR, ls="--")
    if panel.fit is not None:
        axes.plot(grid, panel.fit.curve_kpa - observed, color=CMAES, ls="-.", lw=1.0)
    phase, se = target.phase[target.measured], target.stiffness_se_kpa[target.measured]
    axes.errorbar(phase, 0.0 * phase, se, fmt="none", ecolor=OBSERVED, **ERROR_BAR)
    axes.set_xlabel("fraction of the cardiac cycle from the R peak, $s$")
    axes.set_ylabel("predicted −\nobserved (kPa)")


def _write_scores(axes: Axes, panel: PredictivePanel) -> None:
    """Write the scores as a table, then the features, then the support numbers."""
    axes.set_axis_off()
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.0)
    top = _write_table(axes, 1.0, _score_rows(panel), (0.0, 0.66, 0.83, 1.0))
    top = _write_table(axes, top, _coverage_rows(panel), (0.0, 0.76, 1.0))
    features = _feature_rows(panel)
    top = _write_table(axes, top - LINE_HEIGHT, features, (0.0, 0.60, 0.66, 1.0))
    lines: list[Row] = [(line,) for line in _verdict_lines(panel)]
    _write_table(axes, top - LINE_HEIGHT, lines, (0.0,))


def _verdict_lines(panel: PredictivePanel) -> list[str]:
    verdict = panel.verdict
    if is_exact(verdict):
        made = [f"draws by {sampler_in_words(verdict)}", f"  {weights_in_words(verdict)}"]
        return [f"verdict: {verdict.status}", *verdict_numbers(verdict), *made]
    words = "within prior support" if panel.check.may_be_read else "excluded: outside prior support"
    return [words, *verdict_numbers(verdict), f"  in {feature_label(verdict.worst_component)}"]


def _score_rows(panel: PredictivePanel) -> list[Row]:
    prior, posterior = panel.check.prior, panel.check.posterior
    reduction = reduction_percent(prior.scores.rmse_kpa, posterior.scores.rmse_kpa)
    name, fitted = ("", ()) if panel.fit is None else ("CMA-ES", (panel.fit.rmse_kpa,))
    rmse = _numbers(2, prior.scores.rmse_kpa, posterior.scores.rmse_kpa, *fitted)
    return [
        ("", "prior", "post.", name),
        ("RMSE (kPa)", *rmse, *([] if fitted else [""])),
        ("  reduction (%)", "", *_numbers(1, reduction), ""),
        ("NRMSE", *_numbers(3, prior.scores.nrmse, posterior.scores.nrmse), ""),
        ("$R^2$", *_numbers(3, prior.scores.r2, posterior.scores.r2), ""),
        (
            "post-peak RMSE (kPa)",
            *_numbers(2, prior.scores.post_peak_rmse_kpa, posterior.scores.post_peak_rmse_kpa),
            "",
        ),
    ]


def _coverage_rows(panel: PredictivePanel) -> list[Row]:
    """Return what each interval holds of the grid and of the measured phases."""
    mass, both = as_percent(panel.check.interval), (panel.check.prior, panel.check.posterior)
    alone = "measurement noise alone" if is_exact(panel.verdict) else "with recording noise"
    return [
        ("coverage, grid | phases", "prior", "posterior"),
        (f"  {mass} band, noiseless", *_coverages("noiseless", *both)),
        (f"  {mass} PI, with noise", *_coverages("observed", *both)),
        ("  envelope, noiseless", *_coverages("envelope", *both)),
        (f"  {alone}", *(f"– | {_numbers(2, part.coverage_recording_noise)[0]}" for part in both)),
    ]


def _coverages(name: str, *predictions: Prediction) -> Row:
    both = ((part.coverages, part.phase_coverages) for part in predictions)
    return tuple(" | ".join(_numbers(2, *(getattr(part, name) for part in parts))) for parts in both)


def _feature_rows(panel: PredictivePanel) -> list[Row]:
    """Compare observed features with the posterior's intervals, the prior's where there is no posterior."""
    check = panel.check
    which, name = (check.posterior, "posterior") if check.may_be_read else (check.prior, "prior")
    features = which.features
    rows: list[Row] = [("feature, observed", "", "", f"{name} {as_percent(panel.check.interval)} PI")]
    for j, label in enumerate(check.target.feature_names):
        low, high = features.predicted.low[j], features.predicted.high[j]
        mark = "in" if features.inside[j] else "out"
        interval = f"{mark} [{digits(low)}, {digits(high)}]"
        rows.append((feature_label(label), digits(features.observed[j]), "", interval))
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
