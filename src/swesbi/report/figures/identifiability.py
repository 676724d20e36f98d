"""What the recordings tell: what they narrow, what they cannot separate, and which phases carry it."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pandas as pd
from matplotlib.figure import SubFigure
from matplotlib.ticker import MaxNLocator

from swesbi.artefacts.csv import PlainTable
from swesbi.artefacts.typed import BySubject
from swesbi.checks.identifiability.power_scaling import SENSITIVE
from swesbi.heart.model import isometric_share
from swesbi.parameters import ISOMETRIC, ISOMETRIC_SYMBOL, K_0, K_ATP, PHI_SYMBOLS, THETA_LABELS
from swesbi.posterior.result import ExactPosterior
from swesbi.report.figures.band import PHASE, cycle_axis, from_zero
from swesbi.report.figures.forest import Panel, finish_panel
from swesbi.report.figures.style import (
    CMAES,
    OBSERVED,
    POSTERIOR,
    PRIOR,
    SERIES,
    TEXT_WIDTH_IN,
    Drawing,
    columns,
    new_figure,
    panel_grid,
    plain,
    plain_decades,
    rows,
    style,
    titled,
)
from swesbi.report.numbers import fixed

SYMBOLS: Final = {**PHI_SYMBOLS, ISOMETRIC: ISOMETRIC_SYMBOL}
PARTS: Final = {
    "prior": ("prior of the four parameters", PRIOR),
    "nuisances": ("prior of the nuisance parameters", SERIES[4]),
    "likelihood": ("likelihood", POSTERIOR),
}
WIDTH_IN: Final = 1.45 * TEXT_WIDTH_IN
FRAME_IN: Final = 0.55
SUMMARY_IN: Final = 1.7
PAIR_IN: Final = 1.2
PHASES_IN: Final = 1.25
LANE: Final = 0.25
SHOWN_DRAWS: Final = 300
MARGIN: Final = 1.1


def draw_identifiability(
    posteriors: BySubject[ExactPosterior], summary: PlainTable, information: PlainTable, *, cohort_title: str
) -> Drawing:
    """Draw what every quantity owes to what, the pair k_0 and k_ATP of each subject, and the phases.

    Args:
        posteriors: Of all subjects.
        summary: ``identifiability.csv``.
        information: ``information.csv``.
        cohort_title: What the subjects are ("virtual volunteers").
    """
    names = list(dict.fromkeys(summary["subject"]))
    heights = [SUMMARY_IN, FRAME_IN + PAIR_IN * rows(len(names)), FRAME_IN + PHASES_IN]
    with style():
        figure = new_figure(WIDTH_IN, sum(heights))
        grid = figure.add_gridspec(3, 1, height_ratios=heights)
        above, middle, below = (figure.add_subfigure(grid[row]) for row in range(3))
        _draw_summary(above, summary)
        _draw_pairs(middle, posteriors, summary, names)
        _draw_phases(below, information, names)
        above.suptitle(titled("What the recordings tell", cohort_title), fontsize=7.5)
    return figure


def _draw_summary(figure: SubFigure, summary: pd.DataFrame) -> None:
    """Draw a point a subject in the row of each quantity: its contraction, and its sensitivities."""
    contraction, sensitivity = figure.subplots(1, 2, sharey=True)
    row = summary["quantity"].map(list(SYMBOLS).index).to_numpy(float)
    contraction.plot(summary["contraction_log"], row, "o", color=OBSERVED, ms=2.6, mew=0.0, alpha=0.6)
    for lane, (part, (label, color)) in enumerate(PARTS.items()):
        at = row + LANE * (lane - 1)
        look: Any = {"color": color, "ms": 2.8, "mew": 0.0, "alpha": 0.8, "label": label}
        sensitivity.plot(summary[f"sensitivity_{part}"], at, "o", **look)
    finish_panel(contraction, Panel("Contraction", "1 − posterior / prior variance"))
    per_doubling = Panel("Sensitivity to power scaling", "distance per doubling of the power", "log")
    finish_panel(sensitivity, per_doubling)
    sensitivity.axvline(SENSITIVE, color=CMAES, lw=0.8, ls="--", zorder=0, label=f"{SENSITIVE:g}: sensitive")
    contraction.set_yticks(range(len(SYMBOLS)), list(SYMBOLS.values()))
    contraction.set_ylim(len(SYMBOLS) - 0.5, -0.5)
    entries = sensitivity.get_legend_handles_labels()
    figure.legend(*entries, loc="outside right center", handlelength=1.4)


def _draw_pairs(
    figure: SubFigure, posteriors: BySubject[ExactPosterior], summary: pd.DataFrame, names: list[str]
) -> None:
    """Draw k_0 and k_ATP of each subject, with the line of its median isometric stiffness."""
    panels = panel_grid(figure, len(names))
    figure.suptitle("What cannot be told apart, with the correlation of the logarithms", fontsize=7.0)
    isometric = summary[summary["quantity"] == ISOMETRIC].set_index("subject")
    for axes, name in zip(panels, names, strict=True):
        phi = posteriors[name].phi
        shown = phi[np.linspace(0, len(phi) - 1, min(SHOWN_DRAWS, len(phi))).astype(np.int64)]
        look: Any = {"color": POSTERIOR, "ms": 1.8, "mew": 0.0, "alpha": 0.5, "label": "posterior draws"}
        axes.plot(shown[:, K_ATP], shown[:, K_0], ".", **look)
        along = np.geomspace(shown[:, K_ATP].min() / MARGIN, shown[:, K_ATP].max() * MARGIN, 100)
        share = isometric_share(along, float(isometric["activation_duration_s"][name]))
        line = float(isometric["median"][name]) / share
        axes.plot(along, line, "--", color=CMAES, lw=0.9, label="equal " + ISOMETRIC_SYMBOL)
        r = np.corrcoef(np.log(phi[:, K_0]), np.log(phi[:, K_ATP]))[0, 1]
        axes.set_title(f"{plain(name)}: $r$ = {fixed(float(r), 2)}", pad=2.0)
        axes.set_xscale("log")
        axes.set_yscale("log")
        plain_decades(axes.xaxis)
        plain_decades(axes.yaxis)
    for first in panels[:: columns(len(names))]:
        first.set_ylabel(THETA_LABELS[K_0])
    for last in panels[-columns(len(names)) :]:
        last.set_xlabel(THETA_LABELS[K_ATP])
    entries = panels[0].get_legend_handles_labels()
    figure.legend(*entries, loc="outside lower center", ncols=2, markerscale=3.0)


def _draw_phases(figure: SubFigure, information: pd.DataFrame, names: list[str]) -> None:
    """Draw by how much the expected sd of each quantity grows without a phase, a line a subject."""
    panels = figure.subplots(1, len(SYMBOLS))
    for axes, (quantity, symbol) in zip(panels, SYMBOLS.items(), strict=True):
        table = information[information["quantity"] == quantity]
        growth = 100.0 * table["expected_sd_increase"].to_numpy(float)
        for name in names:
            own = (table["subject"] == name).to_numpy()
            axes.plot(table["phase"][own], growth[own], ".-", color=POSTERIOR, lw=0.6, ms=2.5, alpha=0.5)
        cycle_axis(axes, "")
        from_zero(axes, growth)
        axes.yaxis.set_major_locator(MaxNLocator(4, min_n_ticks=3, steps=[1, 2, 5, 10]))
        axes.set_title(symbol)
    panels[0].set_ylabel("growth of the sd\nwithout the phase (%)")
    figure.supxlabel(PHASE, fontsize=7.0)
    figure.suptitle("Information of the phases, a line for each subject", fontsize=7.0)
