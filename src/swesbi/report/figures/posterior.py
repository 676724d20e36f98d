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
    titled,
)
from swesbi.report.numbers import as_percent
from swesbi.verdict.verdict import Verdict

NETWORK_ALONE: Final = "network alone"
HALF: Final = 0.5
EFFICIENCY: Final = "efficiency"


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
        draws = result.phi[:, : len(PHI)]
        return cls(subject, verdict, draws, result.interval_mass, fit, truth, result, start)


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
        for reference, point in (("fit", panel.fit_theta), ("truth", panel.truth)):
            if point is not None and j < len(THETA):
                yield subject, name, reference, *[point[j]] * 3
    if exact is not None:
        yield subject, EFFICIENCY, "MCMC" if exact.by_mcmc else "weights", *[exact.efficiency] * 3


def _half(series: str) -> str:
    return f"half of the {series}"


def _relative(name: str) -> str:
    return f"{name} about its median"
