"""The predictive check of a free-running recording: its pushes, and what prior and posterior make of them."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from swesbi.checks.free_predictive import FreePredictiveCheck
from swesbi.report.figures.recording import MEAN
from swesbi.report.figures.style import POSTERIOR, PRIOR, STATUS_COLORS, new_figure, style, titled
from swesbi.report.numbers import as_percent
from swesbi.verdict.verdict import Verdict


def draw_free_check(
    subject: str, check: FreePredictiveCheck, verdict: Verdict, errors: str, cohort_title: str
) -> Figure:
    """Draw bands of noiseless curves, pushes with standard errors and intervals of new pushes.

    Args:
        subject: Name.
        check: The check.
        verdict: What is said of the subject.
        errors: What the standard errors are computed from.
        cohort_title: What the subject is one of ("virtual volunteers").
    """
    mass = as_percent(check.interval)
    with style():
        figure = new_figure(6.4, 3.8)
        axes = figure.add_subplot()
        shown = ((check.prior, PRIOR, "prior", "--"), (check.posterior, POSTERIOR, "posterior", "-"))
        for band, colour, name, line in shown:
            colour = STATUS_COLORS[verdict.status] if colour == POSTERIOR else colour
            axes.plot(check.grid, band.median, color=colour, ls=line, label=f"{name} median")
            label = f"{name} {mass} band, noiseless"
            axes.fill_between(check.grid, band.low, band.high, color=colour, alpha=0.25, lw=0, label=label)
        look: dict[str, Any] = {"color": POSTERIOR, "lw": 2.2, "alpha": 0.3}
        axes.vlines(check.phase, check.pushes.low, check.pushes.high, label=f"new push, {mass} PI", **look)
        se = 2.0 * check.relative_se * check.stiffness_kpa
        axes.errorbar(check.phase, check.stiffness_kpa, se, **{**MEAN, "label": "push ± SE"})
        axes.set(xlabel="cycle fraction $s$", ylabel="$E = 3\\rho c_s^2$ (kPa)", xlim=(0.0, 1.0))
        axes.set_ylim(0.0, 1.3 * max(check.stiffness_kpa.max(), check.pushes.high.max()))
        inside = f"{as_percent(round(check.coverage, 2))} of {len(check.phase)} pushes in their intervals"
        title = titled(f"{subject}, predictive check", cohort_title)
        figure.suptitle("\n".join([title, f"{verdict.status}; {inside}", f"errors: {errors}"]), fontsize=8.0)
        figure.legend(loc="outside lower center", ncols=3, columnspacing=1.2, handlelength=1.8)
    return figure
