"""Calibration of an experiment: ranks and coverage on recordings of known parameters."""

from __future__ import annotations

from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from swesbi.checks.calibration.dataset import Calibration, Diagnostics
from swesbi.checks.calibration.ranks import (
    NETWORK,
    QUANTITY_NAMES,
    WEIGHTED,
    RankedRecordings,
    band,
    points,
    uniformity,
)
from swesbi.checks.calibration.table import (
    JOINT,
    LOCAL,
    POOLED,
    REPORTED_LEVEL,
    SBC,
    TARP,
    CalibrationTable,
    binomial_ends,
)
from swesbi.checks.settings import JudgementSettings
from swesbi.parameters import ISOMETRIC, ISOMETRIC_SYMBOL, PHI_SYMBOLS
from swesbi.population.recordings import MODEL_NOISE, SAMPLE_BY_SAMPLE
from swesbi.report.figures.forest import Panel, Series, finish_panel, intervals, name_rows
from swesbi.report.figures.style import (
    EXCLUDED_BACKGROUND,
    POSTERIOR,
    PRIOR,
    SERIES,
    WIDE_IN,
    Drawing,
    drawing,
    in_percent,
    titled,
)
from swesbi.report.figures.style import NETWORK as STYLE_NETWORK
from swesbi.report.numbers import as_percent, count, share
from swesbi.verdict.summary import ANSWERS, RECORDINGS

LABELS: Final = {
    **PHI_SYMBOLS, ISOMETRIC: ISOMETRIC_SYMBOL, "log_likelihood": "log-likelihood", JOINT: "all jointly",
}  # fmt: skip
LOOK: Final = {
    f"{sampler} {kind}": Series(color, f"{ANSWERS[sampler]}, {RECORDINGS[kind]}", filled=kind == MODEL_NOISE)
    for sampler, color in ((NETWORK, STYLE_NETWORK), (WEIGHTED, POSTERIOR))
    for kind in (MODEL_NOISE, SAMPLE_BY_SAMPLE)
}
"""Of sampler and kind of recordings: the colour is the sampler, open marks are acquired recordings."""


def draw_calibration(
    calibration: Calibration,
    table: CalibrationTable,
    *,
    judgement: JudgementSettings,
    max_k_hat: float,
    experiment: str,
    cohort_title: str,
) -> Drawing:
    """Draw the ranks of each quantity in the reported posterior, and the coverage of both samplers.

    Weights of a Pareto shape above ``max_k_hat`` are not used.
    """
    own = calibration.model_noise
    title = titled(f"Calibration of the experiment '{experiment}'", f"contexts of the {cohort_title}")
    weights = _weights(own.diagnostics, max_k_hat)
    with drawing(WIDE_IN, 4.1, f"{title}\n{weights}") as figure:
        ranks, covered = figure.subplots(1, 2)
        _draw_ranks(ranks, own.ranked, judgement.alpha)
        _draw_coverage(covered, table, judgement.confidence)
        for axes, entries_a_row in ((ranks, 3), (covered, 1)):
            axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=entries_a_row)
    return figure


def _weights(diagnostics: Diagnostics, max_k_hat: float) -> str:
    """Say how reliable the importance weights were."""
    high = float(np.mean(diagnostics.k_hat > max_k_hat))
    return (
        f"{count(len(diagnostics.k_hat))} recordings under {RECORDINGS[MODEL_NOISE]}; weights: median "
        f"efficiency {share(float(np.median(diagnostics.efficiency)), 0)}, k-hat above {max_k_hat:g} in "
        f"{share(high)}, MCMC in {int(diagnostics.by_mcmc.sum())}"
    )


def _draw_ranks(axes: Axes, ranked: RankedRecordings, alpha: float) -> None:
    """Draw distribution functions of ranks less the uniform one, over the band for all recordings."""
    low, high = band(len(ranked.truth), alpha / len(ranked.names))
    at = np.concatenate([[0.0], points(), [1.0]])
    label = f"band, left by chance in {as_percent(alpha)}"
    axes.fill_between(
        at, np.pad(low, 1), np.pad(high, 1), color=EXCLUDED_BACKGROUND, lw=0, zorder=-1, label=label
    )
    axes.axhline(0.0, color=PRIOR, lw=0.8, ls="--", zorder=0)
    for column, (name, color) in enumerate(zip(QUANTITY_NAMES, SERIES, strict=False)):
        difference = uniformity(ranked.weighted.level[:, column]).difference
        axes.plot(at, np.pad(difference, 1), color=color, lw=0.9, label=LABELS[name])
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(5, min_n_ticks=3))
        in_percent(axis)
    axes.set(
        title="(a) ranks in the exact posterior",
        xlabel="posterior draws below the truth",
        ylabel="share of recordings, less the expected one",
        xlim=(0.0, 1.0),
    )


def _draw_coverage(axes: Axes, table: pd.DataFrame, confidence: float) -> None:
    """Draw the coverage of the 90 % intervals with its Clopper-Pearson intervals, a row a quantity."""
    shown = table[(table["subject"] == POOLED) & table["test"].isin([SBC, TARP])]
    shown = shown[shown["quantity"].isin(LABELS) & (shown["recordings"] != LOCAL)]
    ends = [
        binomial_ends(round(covered * n), n, confidence)
        for covered, n in zip(shown["coverage_90"], shown["n"], strict=True)
    ]
    rows = pd.DataFrame(ends, columns=["low", "high"]).assign(
        coverage=shown["coverage_90"].to_numpy(),
        row=shown["quantity"].to_numpy(),
        series=(shown["sampler"] + " " + shown["recordings"]).to_numpy(),
    )
    intervals(axes, rows, LOOK, order=list(LABELS), of=("low", "coverage", "high"))
    name_rows(axes, list(LABELS.values()))
    label = f"coverage ({as_percent(confidence)} Clopper-Pearson intervals)"
    title = f"(b) {as_percent(REPORTED_LEVEL)} intervals and regions"
    finish_panel(axes, Panel(title, label, "percent", REPORTED_LEVEL))
