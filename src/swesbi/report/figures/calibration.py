"""How far an experiment can be relied on: training, ranks and coverage, coverage by stratum, false alarms."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, MaxNLocator

from swesbi.artefacts.typed import BySubject
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
    ALARMS,
    JOINT,
    LOCAL,
    POOLED,
    REPORTED_LEVEL,
    SBC,
    TARP,
    AlarmTable,
    CalibrationTable,
    StrataTable,
    binomial_ends,
)
from swesbi.checks.settings import JudgementSettings
from swesbi.networks.training import TrainingTable
from swesbi.parameters import ISOMETRIC, ISOMETRIC_SYMBOL, PHI_SYMBOLS
from swesbi.population.recordings import MODEL_NOISE, SAMPLE_BY_SAMPLE
from swesbi.report.figures.forest import Panel, Series, draw_rows, forest
from swesbi.report.figures.style import (
    EXCLUDED_BACKGROUND,
    OBSERVED,
    POSTERIOR,
    PRIOR,
    SERIES,
    STATUS_COLORS,
    TEXT_WIDTH_IN,
    WIDE_IN,
    Drawing,
    drawing,
    few_ticks,
    in_percent,
    plain,
    shared_legend,
    titled,
)
from swesbi.report.figures.style import NETWORK as STYLE_NETWORK
from swesbi.report.numbers import PARAMETERS, as_percent, count, share
from swesbi.verdict.summary import ANSWERS, RECORDINGS, label_of_test
from swesbi.verdict.verdict import Verdict

LABELS: Final = {
    **PHI_SYMBOLS, ISOMETRIC: ISOMETRIC_SYMBOL, "log_likelihood": "log-likelihood", JOINT: "all jointly",
}  # fmt: skip
LOOK: Final = {
    f"{sampler} {kind}": Series(color, f"{ANSWERS[sampler]}, {RECORDINGS[kind]}", filled=kind == MODEL_NOISE)
    for sampler, color in ((NETWORK, STYLE_NETWORK), (WEIGHTED, POSTERIOR))
    for kind in (MODEL_NOISE, SAMPLE_BY_SAMPLE)
}
"""Of sampler and kind of recordings: the colour is the sampler, open marks are acquired recordings."""
STRATA: Final = {"all": "all", "sex F": "female", "sex M": "male"}
STRATIFIED: Final = {
    "age_years": ("age", "years"),
    "hr_bpm": ("heart rate", "/min"),
    "lvedv_ml": ("LVEDV", "mL"),
    "ivsd_cm": ("septum", "cm"),
    "relative_se": ("noise of a speed", ""),
}
ASKED: Final = (
    (0.05, "#EFEFEF", "± 5 points: asked of each stratum"),
    (0.02, "#D2D2D2", "± 2 points: asked of all"),
)
STRATA_LOOK: Final = {
    name: Series(color, symbol) for (name, symbol), color in zip(PARAMETERS.items(), SERIES, strict=False)
}
LEAST_P: Final = 1e-4
"""Where smaller p-values are drawn, below all that null recordings can tell."""


def draw_training(training: TrainingTable, *, trained_on: str) -> Drawing:
    """Draw both losses, mean -log q(theta | z) per row, with the epoch of the lowest validation loss."""
    epoch = training["epoch"].to_numpy()
    best = int(np.argmin(training["validation_loss"].to_numpy()))
    title = titled("Training of the estimator", trained_on)
    with drawing(TEXT_WIDTH_IN, 2.4, title) as figure:
        axes = figure.subplots()
        axes.plot(epoch, training["training_loss"], color=STYLE_NETWORK, label="training")
        axes.plot(
            epoch, training["validation_loss"], color=STYLE_NETWORK, ls="--", alpha=0.6, label="validation"
        )
        label = f"lowest validation loss (epoch {int(epoch[best])})"
        axes.axvline(epoch[best], color=PRIOR, lw=0.8, ls=":", label=label)
        axes.xaxis.set_major_locator(few_ticks(integer=True))
        axes.set(
            xlabel="epoch: passes over the training set",
            ylabel=r"loss, mean $-\log\,q(\theta\,|\,z)$",
        )
        shared_legend(figure, [axes], entries_a_row=3)
    return figure


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
    label = f"coverage ({as_percent(confidence)} Clopper-Pearson intervals)"
    title = f"(b) {as_percent(REPORTED_LEVEL)} intervals and regions"
    panel = Panel(title, label, "percent", REPORTED_LEVEL)
    draw_rows(axes, rows, LOOK, panel, LABELS, of=("low", "coverage", "high"))


def stratum_label(name: str) -> str:
    """Return a stratum in words: "age_years 18 to 40" as "age 18 to 40 years"."""
    quantity, _, limits = name.partition(" ")
    if quantity not in STRATIFIED:
        return STRATA.get(name, name)
    word, unit = STRATIFIED[quantity]
    return f"{word} {limits} {unit}" if unit else f"{word} {_as_percent(limits)}"


def _as_percent(limits: str) -> str:
    """Return limits of a fraction in percent, with one sign: "0.01 to 0.0205" as "1 to 2.05 %"."""
    shown = re.sub(r"\d\S*", lambda number: f"{100.0 * float(number[0]):g}", limits)
    return re.sub(r"(\d)(\D*)$", r"\1 %\2", shown)


def draw_strata(strata: StrataTable, *, interval: float, experiment: str) -> Drawing:
    """Draw coverage by stratum, a panel a sampler, with recordings and efficiency of the weights in names."""
    shown = strata[np.isclose(strata["nominal"], interval)]
    if shown.empty:
        raise ValueError(f"no coverage of {as_percent(interval)} intervals is in the table of strata")
    names = {
        str(row["stratum"]): f"{stratum_label(row['stratum'])} ({count(row['n'])}; "
        f"{share(row['median_efficiency'], 0)})"
        for row in shown.drop_duplicates("stratum").to_dict("records")
    }
    panels = {
        sampler: Panel(ANSWERS[sampler], "coverage", "percent", interval) for sampler in (WEIGHTED, NETWORK)
    }
    title = (
        f"Coverage of {as_percent(interval)} intervals by stratum: fresh contexts of the experiment "
        f"'{experiment}'\nin brackets: recordings; median efficiency of the weights"
    )
    rows = shown.assign(panel=shown["sampler"], row=shown["stratum"], series=shown["parameter"])
    low = min(interval - 0.06, shown["ci_low"].min() - 0.01)
    high = max(interval + 0.06, shown["ci_high"].max() + 0.01)

    def asked(axes: Axes, _: str) -> None:
        for reach, color, label in ASKED:
            axes.axvspan(interval - reach, interval + reach, color=color, lw=0, zorder=-1, label=label)
        axes.set_xlim(low, high)

    return forest(
        rows, panels, STRATA_LOOK, title=title, names=names, of=("ci_low", "coverage", "ci_high"),
        behind=asked, entries_a_row=5,
    )  # fmt: skip


def misspecification_figure(
    table: AlarmTable,
    verdicts: BySubject[Verdict],
    *,
    cohort_title: str,
    doubtful_level: float,
    judgement: JudgementSettings,
) -> Drawing:
    """Draw every subject's p-values and verdict, and beside them how often the tests raise an alarm.

    ``doubtful_level`` is the false-alarm rate that the rule is to keep.
    """
    subjects = dict(verdicts)
    height_in = 1.4 + max(1.4, 0.26 * len(subjects))
    with drawing(WIDE_IN, height_in, titled("Misspecification tests", cohort_title)) as figure:
        tests, rates = figure.subplots(1, 2)
        _draw_p_values(tests, subjects)
        _draw_rates(rates, table, doubtful_level, judgement.confidence)
        shared_legend(figure, [tests, rates], entries_a_row=4)
    return figure


def _draw_p_values(axes: Axes, verdicts: Mapping[str, Verdict]) -> None:
    """Draw the p-values of each subject, filled where they are flagged, and name its verdict."""
    rows = pd.DataFrame(
        [
            (subject, test.name, f"{test.name} {test.flagged}", max(test.p_value, LEAST_P))
            for subject, verdict in verdicts.items()
            for test in verdict.tests
            if test.p_value is not None
        ],
        columns=["row", "test", "series", "p_value"],
    )
    look = {}
    for test, color in zip(dict.fromkeys(rows["test"]), SERIES[2:], strict=False):
        words = label_of_test(test)
        look[f"{test} False"] = Series(color, words, filled=False, lane=test, size=3.4)
        look[f"{test} True"] = Series(color, f"{words}, flagged", lane=test, size=4.4)
    names = {subject: plain(f"{subject}: {verdict.status}") for subject, verdict in verdicts.items()}
    panel = Panel("(a) tests of each subject", "p-value among well-specified recordings", "log")
    draw_rows(axes, rows, look, panel, names, of=("p_value",) * 3)
    for ticked, verdict in zip(axes.get_yticklabels(), verdicts.values(), strict=True):
        ticked.set_color(STATUS_COLORS.get(verdict.status, PRIOR))
    axes.set_xlim(0.5 * LEAST_P, 2.0)
    axes.xaxis.set_major_locator(LogLocator())


def _draw_rates(axes: Axes, table: pd.DataFrame, level: float, confidence: float) -> None:
    """Draw the share of well-specified recordings on which each test, and the verdict, raise an alarm."""
    numbers = table.drop_duplicates("recordings").set_index("recordings")["n"]
    look = {
        kind: Series(OBSERVED, f"{RECORDINGS[kind]} (n = {count(numbers[kind])})", filled=filled)
        for kind, filled in ((MODEL_NOISE, True), (SAMPLE_BY_SAMPLE, False))
    }
    rows = table.assign(row=table["alarm"], series=table["recordings"])
    names = {alarm: label_of_test(alarm) for alarm in ALARMS}
    label = f"recordings ({as_percent(confidence)} Clopper-Pearson intervals)"
    title = f"(b) false alarms; dashed: {as_percent(level)} asked for"
    panel = Panel(title, label, "percent", level)
    draw_rows(axes, rows, look, panel, names, of=("ci_low", "rate", "ci_high"))
    axes.set_xlim(left=-0.02 * axes.get_xlim()[1])
