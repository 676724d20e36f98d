"""What the recordings tell: what they narrow, what they cannot separate, and which phases carry it."""

from __future__ import annotations

from typing import Final

import numpy as np
import pandas as pd
from matplotlib.figure import SubFigure
from matplotlib.ticker import MaxNLocator

from swesbi.artefacts.csv import PlainTable
from swesbi.artefacts.typed import BySubject
from swesbi.checks.identifiability import SENSITIVE
from swesbi.heart.model import isometric_share
from swesbi.parameters import ISOMETRIC, ISOMETRIC_SYMBOL, K_0, K_ATP, PHI_SYMBOLS, THETA_LABELS
from swesbi.posterior.result import ExactPosterior
from swesbi.report.figures.forest import Panel, finish_panel, name_rows
from swesbi.report.figures.style import (
    CMAES,
    OBSERVED,
    PHASE,
    POSTERIOR,
    PRIOR,
    SERIES,
    WIDE_IN,
    Drawing,
    columns,
    cycle_axis,
    drawing,
    from_zero,
    panel_grid,
    plain,
    plain_decades,
    rows,
    titled,
)
from swesbi.report.numbers import fixed

SYMBOLS: Final = {**PHI_SYMBOLS, ISOMETRIC: ISOMETRIC_SYMBOL}
PARTS: Final = {
    "prior": ("prior of the four parameters", PRIOR),
    "nuisances": ("prior of the nuisance parameters", SERIES[4]),
    "likelihood": ("likelihood", POSTERIOR),
}
SHOWN_DRAWS: Final = 300
MARGIN: Final = 1.1


def draw_identifiability(
    posteriors: BySubject[ExactPosterior], summary: PlainTable, information: PlainTable, *, cohort_title: str
) -> Drawing:
    """Draw what every quantity owes to what, the pair k_0 and k_ATP of each subject, and the phases.

    ``summary`` is ``identifiability.csv``.
    """
    names = list(dict.fromkeys(summary["subject"]))
    heights_in = [1.7, 0.55 + 1.2 * rows(len(names)), 0.55 + 1.25]
    with drawing(WIDE_IN, sum(heights_in)) as figure:
        grid = figure.add_gridspec(3, 1, height_ratios=heights_in)
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
        at, sensitive = row + 0.25 * (lane - 1), summary[f"sensitivity_{part}"]
        sensitivity.plot(sensitive, at, "o", color=color, ms=2.8, mew=0.0, alpha=0.8, label=label)
    finish_panel(contraction, Panel("Contraction", "1 − posterior / prior variance"))
    finish_panel(
        sensitivity, Panel("Sensitivity to power scaling", "distance per doubling of the power", "log")
    )
    sensitivity.axvline(SENSITIVE, color=CMAES, lw=0.8, ls="--", zorder=0, label=f"{SENSITIVE:g}: sensitive")
    name_rows(contraction, list(SYMBOLS.values()))
    figure.legend(*sensitivity.get_legend_handles_labels(), loc="outside right center", handlelength=1.4)


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
        axes.plot(
            shown[:, K_ATP], shown[:, K_0], ".", color=POSTERIOR, ms=1.8, mew=0.0, alpha=0.5,
            label="posterior draws",
        )  # fmt: skip
        along = np.geomspace(shown[:, K_ATP].min() / MARGIN, shown[:, K_ATP].max() * MARGIN, 100)
        share = isometric_share(along, float(isometric["activation_duration_s"][name]))
        line = float(isometric["median"][name]) / share
        axes.plot(along, line, "--", color=CMAES, lw=0.9, label="equal " + ISOMETRIC_SYMBOL)
        r = np.corrcoef(np.log(phi[:, K_0]), np.log(phi[:, K_ATP]))[0, 1]
        axes.set_title(f"{plain(name)}: $r$ = {fixed(float(r), 2)}", pad=2.0)
        plain_decades(axes.xaxis)
        plain_decades(axes.yaxis)
    for first in panels[:: columns(len(names))]:
        first.set_ylabel(THETA_LABELS[K_0])
    for last in panels[-columns(len(names)) :]:
        last.set_xlabel(THETA_LABELS[K_ATP])
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, markerscale=3.0
    )


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
