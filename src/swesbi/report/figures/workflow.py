"""Figure 1: the workflow, drawn from one subject's own prior, curves, features, network and posterior."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from swesbi.artefacts.typed import ByPlace, Place
from swesbi.checks.predictive import PredictiveCheck
from swesbi.networks.paper.pool import Pool
from swesbi.networks.training import TrainingTable
from swesbi.parameters import THETA
from swesbi.posterior.truncated import Posterior
from swesbi.prior import PriorSettings
from swesbi.report.figures.posterior import PosteriorPanel, log_density_of_draws, log_density_of_prior
from swesbi.report.figures.predictive import PredictivePanel, draw_check
from swesbi.report.figures.style import (
    EXCLUDED_BACKGROUND,
    NETWORK,
    OBSERVED,
    PRIOR,
    STIFFNESS,
    Drawing,
    color_of,
    drawing,
    plain,
    plain_decades,
    shared_legend,
    titled,
)
from swesbi.verdict.verdict import Verdict

SHOWN_CURVES: Final = 60
HEADS: Final = ("prior →", "simulated curves →", "features →", "training →", "posterior →", "check")


def workflow_figure(
    pool: Pool,
    training: TrainingTable,
    predictives: ByPlace[PredictiveCheck],
    posteriors: ByPlace[Posterior],
    verdicts: ByPlace[Verdict],
    *,
    cohort_title: str,
    prior: PriorSettings,
) -> Drawing:
    """Draw the workflow with the first subject whose posterior may be read, or else the candidates of one."""
    judged = dict(verdicts)
    place = shown_subject(judged)
    check, verdict, subject = predictives[place], judged[place], plain(place.subject)
    panel = PosteriorPanel.of(place.subject, posteriors[place], verdict)
    excluded = "" if verdict.may_be_read else ", who is excluded"
    what = f"The workflow, {len(pool.subjects)} subjects pooled, here {subject}{excluded}"
    with drawing(6.5, 4.2, titled(what, cohort_title)) as figure:
        axes = list(figure.subplots(2, 3).flat)
        _draw_ridges(axes[0], prior)
        axes[1].plot(check.target.grid, check.prior.draws.curve_kpa[:SHOWN_CURVES].T, color=PRIOR, lw=0.4)
        _draw_features(axes[2], pool, place.subject)
        axes[3].plot(training["epoch"], training["training_loss"], color=NETWORK)
        axes[3].plot(training["epoch"], training["validation_loss"], "--", color=NETWORK, alpha=0.6)
        axes[3].set(xlabel="epoch (dashed: validation)", ylabel="loss")
        _draw_ridges(axes[4], prior, panel)
        draw_check(axes[5], PredictivePanel(place.subject, check, None, verdict))
        for letter, each, head in zip("abcdef", axes, HEADS, strict=True):
            each.set_title(f"({letter}) {head}")
        for curves in (axes[1], axes[5]):
            curves.set(xlabel="phase of the cycle", ylabel=STIFFNESS, xlim=(0.0, 1.0))
        if not verdict.may_be_read:
            axes[4].set_facecolor(EXCLUDED_BACKGROUND)
        shared_legend(figure, [axes[2], axes[5]], entries_a_row=2)
    return figure


def shown_subject(verdicts: Mapping[Place, Verdict]) -> Place:
    """Return the first subject whose posterior may be interpreted, or the first where there is none."""
    return next((place for place, verdict in verdicts.items() if verdict.may_be_read), next(iter(verdicts)))


def _draw_ridges(axes: Axes, prior: PriorSettings, posterior: PosteriorPanel | None = None) -> None:
    """Draw the densities of the parameters one above the other, in multiples of the prior's centre."""
    for j, each in enumerate(prior.parameters):
        densities = {PRIOR: log_density_of_prior(each)}
        if posterior is not None:
            densities[color_of(posterior.verdict)] = log_density_of_draws(posterior.draws[:, j])
        for color, (theta, density) in densities.items():
            ridge = j - 0.8 * density / density.max()
            axes.fill_between(theta / each.centre, ridge, j, color=color, alpha=0.5, lw=0.5)
    plain_decades(axes.xaxis)
    axes.set_yticks(range(len(THETA)), [parameter.tex for parameter in THETA])
    axes.set(ylim=(len(THETA) - 0.9, -1.0), xlabel="value over the prior's centre")


def _draw_features(axes: Axes, pool: Pool, subject: str) -> None:
    """Draw the standardised features: most of the subject's simulations, copies of one, and the observed."""
    rows = pool.subject_index == pool.subjects.index(subject)
    copies = pool.z[rows & (pool.draw_index == pool.draw_index[rows].min())].astype(np.float64)
    position = np.arange(copies.shape[1])
    axes.vlines(position, *np.quantile(pool.z[rows], (0.05, 0.95), axis=0), color=PRIOR, lw=1.0, alpha=0.5)
    axes.plot(position, copies.T, ".", ms=1.6, mew=0, color=NETWORK, alpha=0.5)
    axes.plot(position, pool.observed_z(subject), ".", ms=2.6, mew=0, color=OBSERVED)
    for color, label in ((NETWORK, f"features, {len(copies)} noisy copies"), (OBSERVED, "features observed")):
        axes.plot([], [], "o", ms=3.0, mew=0, color=color, label=label)
    axes.set(xlabel="feature or context", ylabel="standardised")
