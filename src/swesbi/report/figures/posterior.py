"""Posteriors and densities: of a whole cohort (figure 3), and of one subject as a corner plot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.special import ndtr

from swesbi.base.arrays import FloatArray
from swesbi.draws import density_of_pairs, kernel_density, median_and_interval
from swesbi.parameters import PHI, PHI_LABELS, THETA, ParameterPrior
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.truncated import Posterior
from swesbi.prior import JointPriorSettings, PriorSettings, quantile
from swesbi.report.figures.forest import ENDS, MOST_ROWS, Panel, Series, forest
from swesbi.report.figures.style import (
    CMAES,
    EXCLUDED_BACKGROUND,
    NETWORK,
    OBSERVED,
    POSTERIOR,
    PRIOR,
    STATUS_COLORS,
    TRUTH,
    color_of,
    drawing,
    few_ticks,
    shared_legend,
    titled,
)
from swesbi.report.numbers import as_percent, digits, fixed
from swesbi.verdict.summary import verdict_numbers
from swesbi.verdict.verdict import Verdict

NETWORK_ALONE: Final = "network alone"
HALF: Final = 0.5
EFFICIENCY: Final = "efficiency"
POINTS: Final = 256
SHOWN_DRAWS: Final = 2000
RANGE_QUANTILES: Final = (0.002, 0.998)
DENSITY_QUANTILES: Final = (0.0005, 0.9995)
PRIOR_TAIL: Final = 0.05
MARGIN: Final = 0.06
GRID_POINTS: Final = 50


@dataclass(frozen=True)
class PosteriorPanel:
    """One subject's posterior of k parameters, as figures show it, with fit and truth (3,) where known.

    ``draws`` (n, k) are unfiltered candidates of a subject that an experiment on features excludes. Only one
    on speeds is ``exact``; ``start`` says what its proposal is.
    """

    subject: str
    verdict: Verdict
    draws: FloatArray
    interval: float
    fit_theta: FloatArray | None = None
    truth: FloatArray | None = None
    exact: ExactPosterior | None = None
    start: str = NETWORK_ALONE

    @classmethod
    def of(
        cls,
        subject: str,
        posterior: Posterior | ExactPosterior,
        verdict: Verdict,
        fit: FloatArray | None = None,
        truth: FloatArray | None = None,
        start: str = NETWORK_ALONE,
    ) -> PosteriorPanel:
        """Return what is shown of a posterior within the prior's bounds, or of an exact one's PHI."""
        exact = posterior if isinstance(posterior, ExactPosterior) else None
        if isinstance(posterior, ExactPosterior):
            draws = posterior.phi[:, : len(PHI)]
        elif verdict.may_be_read:
            draws = posterior.theta
        else:
            draws = posterior.unfiltered[np.all(np.isfinite(posterior.unfiltered), axis=1)]
        return cls(subject, verdict, draws, posterior.interval_mass, fit, truth, exact, start)

    @property
    def references(self) -> dict[str, FloatArray]:
        """The known ones of fit and truth, by the names of their series."""
        points = {"fit": self.fit_theta, "truth": self.truth}
        return {name: point for name, point in points.items() if point is not None}


def draw_posteriors(
    panels: Sequence[PosteriorPanel], prior: PriorSettings | JointPriorSettings, cohort_title: str
) -> Figure:
    """Draw medians and intervals of a cohort over the prior, a row a subject; of a large one, the first ones.

    Those of an experiment on features follow in percent of their medians, since they may be much narrower
    than the prior. Exact ones stand below what the proposal alone says, beside the efficiency of the weights.
    """
    shown, exact = panels[:MOST_ROWS], panels[0].exact is not None
    parameters = PHI[: shown[0].draws.shape[1]]
    rows = pd.DataFrame(
        [row for panel in shown for row in _rows(panel)], columns=["row", "panel", "series", *ENDS]
    )
    known = {each.name: Panel(each.label, scale="log") for each in parameters}
    if exact:
        known[EFFICIENCY] = Panel("efficiency of\nthe weights", scale="percent")
    elif any(panel.verdict.may_be_read for panel in shown):
        known |= {_relative(each.name): Panel(f"{each.tex} about its median (%)") for each in parameters}
    bands = dict(zip((each.name for each in parameters), prior_band(prior).T, strict=False))

    def behind(axes: Axes, name: str) -> None:
        if name in bands:
            axes.axvspan(*bands[name], color=PRIOR, alpha=0.2, lw=0, zorder=-1, label="prior, central 90 %")
        if name == EFFICIENCY:
            axes.set_xlim(0.0, 1.0)
        for place, panel in enumerate(shown):
            if not panel.verdict.may_be_read:
                axes.axhspan(place - 0.5, place + 0.5, color=EXCLUDED_BACKGROUND, lw=0, zorder=-2)

    number = "" if len(shown) == len(panels) else f", the first {len(shown)} of {len(panels)} subjects"
    what = f"Posteriors: medians, {as_percent(HALF)} and {as_percent(shown[0].interval)} intervals{number}"
    return forest(
        rows, known, _look(shown[0]), title=titled(what, cohort_title), behind=behind,
        columns=len(parameters) + exact,
    )  # fmt: skip


def _look(first: PosteriorPanel) -> dict[str, Series]:
    """Return how series look: the proposal above the posterior, fit and truth below it."""
    look = {"start": Series(NETWORK, first.start, width=0.7)}
    exact = {f"posterior, {status}": color for status, color in STATUS_COLORS.items()}
    for name, color in {"posterior": POSTERIOR, **exact}.items():
        look[_half(name)] = Series(color, "", lane="posterior", width=2.2, size=0.0)
        look[name] = Series(color, name, lane="posterior", filled=False)
    candidates = "excluded (grey): median of the candidates"
    return look | {
        "candidates": Series(OBSERVED, candidates, marker="D", filled=False, lane="posterior"),
        "fit": Series(CMAES, "CMA-ES fit", marker="x", filled=False, lane="reference", size=3.2),
        "truth": Series(TRUTH, "truth", marker="*", lane="reference", size=4.2),
        "weights": Series(OBSERVED, "", lane="posterior"),
        "MCMC": Series(OBSERVED, "draws by MCMC", marker="s", filled=False, lane="posterior"),
    }


def _rows(panel: PosteriorPanel) -> Iterator[tuple[object, ...]]:
    """Yield the columns of all that is drawn of a subject."""
    subject, exact = panel.subject, panel.exact
    series = "posterior" if exact is None else f"posterior, {panel.verdict.status}"
    for j, name in enumerate(each.name for each in PHI[: panel.draws.shape[1]]):
        if exact is not None or panel.verdict.may_be_read:
            draws = panel.draws[:, j]
            relative = 100.0 * (draws / np.median(draws) - 1.0)
            for shown, values in ((name, draws), (_relative(name), relative)):
                yield subject, shown, _half(series), *median_and_interval(values, HALF)
                yield subject, shown, series, *median_and_interval(values, panel.interval)
        else:
            yield subject, name, "candidates", *[panel.verdict.unfiltered_median[name]] * 3
        if exact is not None:
            yield subject, name, "start", *median_and_interval(exact.proposal_phi[:, j], panel.interval)
        for reference, point in panel.references.items():
            if j < len(THETA):
                yield subject, name, reference, *[point[j]] * 3
    if exact is not None:
        yield subject, EFFICIENCY, "MCMC" if exact.by_mcmc else "weights", *[exact.efficiency] * 3


def _half(series: str) -> str:
    return f"half of the {series}"


def _relative(name: str) -> str:
    return f"{name} about its median"


def draw_corner(
    panel: PosteriorPanel, prior: PriorSettings | JointPriorSettings, cohort_title: str
) -> Figure:
    """Draw a corner plot of one posterior; of the unfiltered candidates where it may not be read.

    Draws of the proposal are outlines: where they agree with the reported ones, the weights had little to do.
    A subject that is excluded or contradicted is drawn on grey.
    """
    draws, count = panel.draws, panel.draws.shape[1]
    limits = [shown_range(draws[:, j], _references(panel, j)) for j in range(count)]
    side_in = 1.55 * count + 0.55
    with drawing(side_in, side_in, _title(panel, cohort_title), 8.0) as figure:
        grid = np.asarray(figure.subplots(count, count))
        for (row, column), axes in np.ndenumerate(grid):
            if column > row:
                _write_correlation(axes, panel, row, column)
                continue
            _draw_panel(axes, panel, prior.parameters[row], row, column)
            if column < row:
                axes.set_ylim(limits[row])
            finish_corner(axes, (row, column), limits[column], last=count - 1)
            _draw_lines(axes, panel, prior.parameters[column], row, column)
            if not panel.verdict.may_be_read:
                axes.set_facecolor(EXCLUDED_BACKGROUND)
        figure.align_ylabels(list(grid[:, 0]))
        shared_legend(figure, [grid[0, 0]], entries_a_row=3)
    return figure


def _references(panel: PosteriorPanel, j: int) -> list[float]:
    """Return fit and truth of an active parameter: there is no passive stiffness of the same meaning."""
    return [float(point[j]) for point in panel.references.values()] if j < len(THETA) else []


def _draw_panel(axes: Axes, panel: PosteriorPanel, prior: ParameterPrior, row: int, column: int) -> None:
    """Draw a marginal on the diagonal, a pair below it, and outlines of the proposal."""
    draws, exact, color, mass = panel.draws, panel.exact, color_of(panel.verdict), panel.interval
    if column == row:
        unread = exact is None and not panel.verdict.may_be_read
        label = "unfiltered candidates" if unread else "posterior"
        draw_marginal(axes, draws[:, row], prior, color, mass, label)
        if exact is not None:
            label = f"{panel.start}, {as_percent(mass)} region"
            draw_density(axes, exact.proposal_phi[:, row], color=NETWORK, lw=0.8, ls="--", label=label)
        return
    x, y = draws[:, column], draws[:, row]
    axes.plot(x[:SHOWN_DRAWS], y[:SHOWN_DRAWS], ".", color=color, ms=1.5, alpha=0.25, mew=0, rasterized=True)
    draw_contours(axes, x, y, (1.0 - mass, HALF), colors=OBSERVED, linewidths=0.7)
    if exact is not None:
        x, y = exact.proposal_phi[:, column], exact.proposal_phi[:, row]
        draw_contours(axes, x, y, (1.0 - mass,), colors=NETWORK, linewidths=0.8, linestyles="dashed")


def _draw_lines(axes: Axes, panel: PosteriorPanel, prior: ParameterPrior, row: int, column: int) -> None:
    """Draw the prior's bounds in view, and fit and truth: points in pairs, on the axis in marginals."""
    left, right = axes.get_xlim()
    for bound in (prior.low, prior.high):
        if left < bound < right:
            axes.axvline(bound, color=PRIOR, lw=0.9, ls=":", zorder=0.5)
    if row >= len(THETA):
        return
    for name, point in panel.references.items():
        look = _look(panel)[name]
        place = (float(point[column]), float(point[row]) if column < row else 0.0)
        draw_point(axes, place, look.color, look.marker, f"{look.label} (triangle: beyond)")


def _write_correlation(axes: Axes, panel: PosteriorPanel, row: int, column: int) -> None:
    axes.set_axis_off()
    r = fixed(float(np.corrcoef(panel.draws[:, row], panel.draws[:, column])[0, 1]), 2)
    text = f"correlation of\n{PHI[row].tex}, {PHI[column].tex}:\n{r}"
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", fontsize=7.0)


def _title(panel: PosteriorPanel, cohort_title: str) -> str:
    """Return what is shown, what speaks against it, and a warning where the sampler has not converged."""
    verdict, title = panel.verdict, titled(f"{panel.subject}, posterior", cohort_title)
    reasons = ", ".join(verdict_numbers(verdict))
    if panel.exact is None:
        excluded = f"excluded: {reasons}; unfiltered candidates shown"
        return title if verdict.may_be_read else f"{title}\n{excluded}"
    doubt = () if panel.exact.converged else ("NOT CONVERGED: do not use this posterior",)
    return "\n".join([title, f"verdict: {verdict.status}{': ' if reasons else ''}{reasons}", *doubt])


def log_density_of_draws(draws: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return theta and the density per unit of log theta, from draws (n,) by a Gaussian kernel.

    The support ends at the extreme draws. Draws that are all equal give one point of density 1.
    """
    if np.ptp(draws) == 0.0:
        return draws[:1], np.ones(1)
    log_theta = np.log(draws)
    at = np.linspace(log_theta.min(), log_theta.max(), POINTS)
    return np.exp(at), kernel_density(log_theta, at)


def log_density_of_prior(prior: ParameterPrior) -> tuple[FloatArray, FloatArray]:
    """Return theta from bound to bound and the prior's density per unit of log theta."""
    at = np.linspace(np.log(prior.low), np.log(prior.high), POINTS)
    z = (at - np.log(prior.centre)) / prior.log_sd
    mass = ndtr(z[-1]) - ndtr(z[0])
    return np.exp(at), np.exp(-0.5 * z**2) / (np.sqrt(2.0 * np.pi) * prior.log_sd * mass)


def prior_band(prior: PriorSettings | JointPriorSettings) -> FloatArray:
    """Return the prior's central 90 % of each of its d parameters; shape (2, d)."""
    levels = np.repeat([[PRIOR_TAIL], [1.0 - PRIOR_TAIL]], len(prior.parameters), axis=1)
    return quantile(levels, prior)


def shown_range(draws: FloatArray, points: Sequence[float]) -> tuple[float, float]:
    """Return the range of nearly all draws, widened to each point unless that would dwarf them."""
    low, high = map(float, np.quantile(draws, RANGE_QUANTILES))
    reach = high - low
    near = [point for point in points if low - reach <= point <= high + reach]
    low, high = min([low, *near]), max([high, *near])
    margin = MARGIN * (high - low) or MARGIN * abs(high)
    return low - margin, high + margin


def draw_point(axes: Axes, point: tuple[float, float], color: str, marker: str, label: str) -> None:
    """Draw a reference point; beyond the axes as a triangle on their edge, pointing to it."""
    edges = (axes.get_xlim(), axes.get_ylim())
    axes.plot([], [], marker, color=color, ms=5.0, mew=1.3, label=label)
    x, y = (min(max(value, edge[0]), edge[1]) for value, edge in zip(point, edges, strict=True))
    if x != point[0]:
        marker = ">" if point[0] > x else "<"
    elif y != point[1]:
        marker = "^" if point[1] > y else "v"
    axes.plot(x, y, marker, color=color, ms=5.0, mew=1.3, clip_on=False, zorder=5)


def draw_marginal(
    axes: Axes, draws: FloatArray, prior: ParameterPrior, color: str, interval: float, label: str
) -> None:
    """Draw a marginal and the prior, each scaled to its maximum, with median and credible interval."""
    theta, per_log = log_density_of_prior(prior)
    density, mass = per_log / theta, as_percent(interval)
    axes.fill_between(
        theta, density / density.max(), color=PRIOR, alpha=0.3, lw=0, label="prior (dotted: bounds)"
    )
    draw_density(axes, draws, color=color, label=label)
    low, median, high = map(float, median_and_interval(draws, interval))
    axes.axvline(median, color=OBSERVED, lw=0.8, label=f"median; 50 % and {mass} regions")
    for end in (low, high):
        axes.axvline(end, color=OBSERVED, lw=0.7, ls=(0, (3, 2)), label=f"{mass} credible interval")
    axes.set_ylim(0.0, 1.08)
    axes.set_title(f"{digits(median)} ({digits(low)} to {digits(high)})", fontsize=6.5, loc="center")


def draw_density(axes: Axes, draws: FloatArray, **look: Any) -> None:  # noqa: ANN401
    """Draw the density of draws by a Gaussian kernel, scaled to its maximum; nothing if all are equal."""
    if np.ptp(draws) > 0.0:
        at = _span(draws, 4 * GRID_POINTS)
        values = kernel_density(draws, at)
        axes.plot(at, values / values.max(), **look)


def draw_contours(
    axes: Axes,
    x: FloatArray,
    y: FloatArray,
    outside: Sequence[float],
    **look: Any,  # noqa: ANN401
) -> None:
    """Draw highest-density regions by a Gaussian kernel, each leaving so much of the mass outside."""
    x, y = x[:SHOWN_DRAWS], y[:SHOWN_DRAWS]
    if len(x) <= 10 or not abs(np.corrcoef(x, y)[0, 1]) < 1.0:
        return
    across, up = _span(x, GRID_POINTS), _span(y, GRID_POINTS)
    density = density_of_pairs(x, y, across, up)
    ordered = np.sort(density.ravel())
    mass_below = np.cumsum(ordered) / ordered.sum()
    levels = ordered[np.searchsorted(mass_below, outside)]
    axes.contour(across, up, density, levels=levels, **look)


def finish_corner(axes: Axes, place: tuple[int, int], limits: tuple[float, float], last: int) -> None:
    """Give a panel of the lower triangle its limits, with labels at the left and the bottom only."""
    row, column = place
    axes.set(xlim=limits, xlabel=PHI_LABELS[column] if row == last else "")
    axes.xaxis.set_major_locator(few_ticks())
    axes.tick_params(labelbottom=row == last, labelleft=column == 0)
    if column == row:
        axes.set_yticks([])
        axes.spines["left"].set_visible(False)
    else:
        axes.yaxis.set_major_locator(few_ticks())
        axes.set_ylabel("" if column else PHI_LABELS[row])


def _span(draws: FloatArray, points: int) -> FloatArray:
    """Return evenly spaced values across all but the extreme draws."""
    low, high = np.quantile(draws, DENSITY_QUANTILES)
    return np.linspace(float(low), float(high), points)
