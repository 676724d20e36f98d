"""The marginal posteriors of a whole cohort, a panel a parameter (figure 3), on features or exact."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.base.arrays import FloatArray
from swesbi.draws import median_and_interval
from swesbi.parameters import PHI, THETA
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.truncated import Posterior
from swesbi.prior import JointPriorSettings, PriorSettings
from swesbi.report.figures.density import prior_band
from swesbi.report.figures.forest import MOST_ROWS, Panel, Series, forest
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
    titled,
)
from swesbi.report.numbers import as_percent
from swesbi.verdict.verdict import Verdict

NETWORK_ALONE: Final = "network alone"
HALF: Final = 0.5
EFFICIENCY: Final = "efficiency"
COLUMNS: Final = ("row", "panel", "series", "low", "median", "high")
Row = tuple[str, str, str, float, float, float]


@dataclass(frozen=True)
class PosteriorPanel:
    """One subject's posterior of k parameters, as figures show it.

    Attributes:
        subject: Name.
        verdict: The verdict.
        draws: (n, k) draws; unfiltered candidates of a subject that an experiment on features excludes.
        interval: Mass of the credible intervals.
        fit_theta: (3,) the CMA-ES reference fit, if one was made.
        truth: (3,) active parameters that made the recording, of a generated cohort.
        proposal: (m, k) draws with which the exact inference began; None of an experiment on features.
        start: What these are.
        efficiency: Effective share of the weighted draws; NaN of an experiment on features.
        by_mcmc: Whether a sampler, and not the weights, gave the draws.
        converged: Whether the draws may be used.
    """

    subject: str
    verdict: Verdict
    draws: FloatArray
    interval: float
    fit_theta: FloatArray | None = None
    truth: FloatArray | None = None
    proposal: FloatArray | None = None
    start: str = NETWORK_ALONE
    efficiency: float = np.nan
    by_mcmc: bool = False
    converged: bool = True

    @classmethod
    def of_features(
        cls, subject: str, posterior: Posterior, verdict: Verdict, fit: FloatArray | None
    ) -> PosteriorPanel:
        """Return what is shown of a posterior within the prior's bounds."""
        candidates = posterior.unfiltered[np.all(np.isfinite(posterior.unfiltered), axis=1)]
        draws = posterior.theta if verdict.may_be_read else candidates
        return cls(subject, verdict, draws, posterior.interval_mass, fit)

    @classmethod
    def of_speeds(
        cls,
        subject: str,
        result: ExactPosterior,
        verdict: Verdict,
        fit: FloatArray | None,
        truth: FloatArray | None,
        start: str = NETWORK_ALONE,
    ) -> PosteriorPanel:
        """Return what is shown of an exact posterior: the parameters that are reported."""
        draws, proposal = (each[:, : len(PHI)] for each in (result.phi, result.proposal_phi))
        return cls(
            subject, verdict, draws, result.interval_mass, fit, truth, proposal, start,
            result.efficiency, result.by_mcmc, result.converged,
        )  # fmt: skip

    @property
    def color(self) -> str:
        """The colour of the posterior."""
        return color_of(self.verdict)


def draw_posteriors(
    panels: Sequence[PosteriorPanel], prior: PriorSettings | JointPriorSettings, cohort_title: str
) -> Figure:
    """Draw medians and intervals of a cohort over the prior, a row a subject; of a large one, the first ones.

    Those of an experiment on features follow in percent of their medians, since they may be much narrower
    than the prior. Exact ones stand below what the proposal alone says, beside the efficiency of the weights.

    Args:
        panels: One a subject, in the order of the figure.
        prior: The prior, drawn for scale.
        cohort_title: What the subjects are ("virtual volunteers").

    Raises:
        ValueError: There is no panel.
    """
    if not panels:
        raise ValueError("no subject to draw: the cohort is empty")
    shown, exact = panels[:MOST_ROWS], panels[0].proposal is not None
    parameters = PHI[: shown[0].draws.shape[1]]
    rows = pd.DataFrame([row for panel in shown for row in _rows(panel)], columns=list(COLUMNS))
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
    look["candidates"] = Series(OBSERVED, candidates, marker="D", filled=False, lane="posterior")
    look["fit"] = Series(CMAES, "CMA-ES fit", marker="x", filled=False, lane="reference", size=3.2)
    look["truth"] = Series(TRUTH, "truth", marker="*", lane="reference", size=4.2)
    look["weights"] = Series(OBSERVED, "", lane="posterior")
    look["MCMC"] = Series(OBSERVED, "draws by MCMC", marker="s", filled=False, lane="posterior")
    return look


def _rows(panel: PosteriorPanel) -> Iterator[Row]:
    """Yield all that is drawn of a subject."""
    subject, exact = panel.subject, panel.proposal is not None
    series = f"posterior, {panel.verdict.status}" if exact else "posterior"
    for j, name in enumerate(each.name for each in PHI[: panel.draws.shape[1]]):
        if exact or panel.verdict.may_be_read:
            draws = panel.draws[:, j]
            yield subject, name, _half(series), *_ends(draws, HALF)
            yield subject, name, series, *_ends(draws, panel.interval)
            relative = 100.0 * (draws / np.median(draws) - 1.0)
            yield subject, _relative(name), _half(series), *_ends(relative, HALF)
            yield subject, _relative(name), series, *_ends(relative, panel.interval)
        else:
            yield subject, name, "candidates", *_point(panel.verdict.unfiltered_median[name])
        if panel.proposal is not None:
            yield subject, name, "start", *_ends(panel.proposal[:, j], panel.interval)
        for reference, point in (("fit", panel.fit_theta), ("truth", panel.truth)):
            if point is not None and j < len(THETA):
                yield subject, name, reference, *_point(float(point[j]))
    if exact:
        yield subject, EFFICIENCY, "MCMC" if panel.by_mcmc else "weights", *_point(panel.efficiency)


def _ends(draws: FloatArray, mass: float) -> tuple[float, float, float]:
    low, median, high = map(float, median_and_interval(draws, mass))
    return low, median, high


def _point(value: float) -> tuple[float, float, float]:
    return value, value, value


def _half(series: str) -> str:
    return f"half of the {series}"


def _relative(name: str) -> str:
    return f"{name} about its median"
