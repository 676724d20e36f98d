"""Figure 1: the workflow, drawn from one subject's own curves, features and posterior.

(a) prior and context -> simulated curves -> noisy features -> training; (b) recording -> observed features ->
posterior -> predictive check. Here is where the panels stand, what is written above
them, and the arrows; :mod:`swesbi.report.figures.workflow_panels` draws each.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch
from matplotlib.path import Path as MplPath

from swesbi.artefacts.typed import ByPlace, BySubject, Place
from swesbi.checks.predictive import PredictiveCheck
from swesbi.context import Context
from swesbi.networks.paper.pool import Pool
from swesbi.networks.training_tables import TrainingTable
from swesbi.parameters import THETA
from swesbi.posterior.truncated import Posterior
from swesbi.prior import PriorSettings
from swesbi.recording.observation import Observation
from swesbi.report.figures import workflow_panels
from swesbi.report.figures.style import TEXT_WIDTH_IN, Drawing, mark_excluded, new_figure, plain, style
from swesbi.verdict.verdict import Verdict

HEIGHT_IN: Final = 3.52
TITLE_PT: Final = 6.2
PANEL_HEIGHT_IN: Final = 0.94
TITLE_ABOVE_IN: Final = 0.10
ARROW_ABOVE_IN: Final = 0.18
HEAD_ABOVE_IN: Final = 0.37
LONGEST_NAME: Final = 24
ROW_A: Final = 2.11
ROW_B: Final = 0.32


def context_line(context: Context) -> str:
    """Return the context in a line."""
    return (
        f"{context.sex}, {context.age_years:g} y, BSA {context.bsa_m2:g} m², HR {context.hr_bpm:g} bpm, "
        f"LVEDV {context.lvedv_ml:g} mL, LVESV {context.lvesv_ml:g} mL, IVSd {context.ivsd_cm:g} cm"
    )


class Box(NamedTuple):
    """Where a panel's axes lie, in inches from the lower left corner."""

    left: float
    bottom: float
    width: float
    height: float = PANEL_HEIGHT_IN

    @property
    def middle(self) -> float:
        """Horizontal middle."""
        return self.left + self.width / 2.0


PRIOR_BOX: Final = Box(0.38, ROW_A, 0.56)
CURVES_BOX: Final = Box(1.20, ROW_A, 0.92)
FEATURES_BOX: Final = Box(2.38, ROW_A, 1.30)
TRAINING_BOX: Final = Box(3.94, ROW_A, 0.78)
RECORDING_BOX: Final = Box(0.24, ROW_B, 0.92)
OBSERVED_BOX: Final = Box(1.42, ROW_B, 1.20)
POSTERIOR_BOX: Final = Box(3.02, ROW_B, 0.60)
CHECK_BOX: Final = Box(3.88, ROW_B, 0.84)


def workflow_figure(
    pool: Pool,
    training: TrainingTable,
    observations: BySubject[Observation],
    predictives: ByPlace[PredictiveCheck],
    posteriors: ByPlace[Posterior],
    verdicts: ByPlace[Verdict],
    *,
    cohort_title: str,
    prior: PriorSettings,
    estimator_model: str,
) -> Drawing:
    """Draw the workflow with the first subject of ``verdicts`` whose posterior may be interpreted.

    Where there is none the first one is shown, marked as excluded: by its candidates, filtered by no bound.
    """
    judged = dict(verdicts)
    place = shown_subject(judged)
    posterior, verdict = posteriors[place], judged[place]
    candidates = posterior.unfiltered[np.all(np.isfinite(posterior.unfiltered), axis=1)]
    rows = pool.subject_index == pool.subjects.index(place.subject)
    picture = workflow_panels.WorkflowPicture(
        subject=place.subject,
        context=observations[place.subject].context,
        prior=prior,
        check=predictives[place],
        components=pool.components.names,
        pool_z=pool.z[rows].astype(np.float64),
        sample_z=pool.z[rows & (pool.draw_index == pool.draw_index[rows].min())].astype(np.float64),
        z_obs=pool.observed_z(place.subject),
        theta=posterior.theta if verdict.may_be_read else candidates,
        verdict=verdict,
        history=training,
        estimator=estimator_model.upper(),
        subjects=len(pool.subjects),
        rows=len(pool.z),
    )
    return draw_workflow(picture, cohort_title)


def shown_subject(verdicts: Mapping[Place, Verdict]) -> Place:
    """Return the first subject whose posterior may be interpreted, or the first where there is none.

    Raises:
        ValueError: There is no subject.
    """
    if not verdicts:
        raise ValueError("no subject to draw: the cohort is empty")
    return next((place for place, verdict in verdicts.items() if verdict.may_be_read), next(iter(verdicts)))


def draw_workflow(picture: workflow_panels.WorkflowPicture, cohort_title: str) -> Figure:
    """Draw the workflow.

    Args:
        picture: The subject that is shown.
        cohort_title: What the subject is one of ("virtual volunteers").
    """
    with style():
        figure = new_figure(TEXT_WIDTH_IN, HEIGHT_IN)
        figure.set_layout_engine("none")
        workflow_panels.draw_prior(_stack(figure, PRIOR_BOX), picture)
        workflow_panels.draw_curves(_axes(figure, CURVES_BOX), picture)
        workflow_panels.draw_features(_axes(figure, FEATURES_BOX), picture)
        workflow_panels.draw_training(_axes(figure, TRAINING_BOX), picture)
        workflow_panels.draw_recording(_axes(figure, RECORDING_BOX), picture)
        workflow_panels.draw_observed_features(_axes(figure, OBSERVED_BOX), picture)
        posterior = _stack(figure, POSTERIOR_BOX)
        workflow_panels.draw_posterior(posterior, picture)
        check = _axes(figure, CHECK_BOX)
        workflow_panels.draw_check(check, picture)
        if not picture.verdict.may_be_read:
            for axes in (*posterior, check):
                mark_excluded(axes)
        _write(figure, picture, cohort_title)
        _connect(figure, picture)
    return figure


def _write(figure: Figure, picture: workflow_panels.WorkflowPicture, cohort_title: str) -> None:
    """Write the heads of both rows, the title of each panel, and the context."""
    copies = len(picture.sample_z)
    state = "" if picture.verdict.may_be_read else " (excluded)"
    subject = _short(picture.subject)
    heads = {
        ROW_A: f"(a) Training: {picture.subjects} {plain(cohort_title)} pooled, here {subject}",
        ROW_B: f"(b) Inference: {subject}{state}",
    }
    for bottom, head in heads.items():
        y = bottom + PANEL_HEIGHT_IN + HEAD_ABOVE_IN
        _text(figure, 0.06, y, head, fontsize=7.0, fontweight="bold", ha="left")
    titles = {
        PRIOR_BOX: r"$\theta \sim p(\theta)$",
        CURVES_BOX: "$E_\\mathrm{sim}(s)$ (kPa)",
        FEATURES_BOX: rf"$z$, {copies} noisy copies",
        TRAINING_BOX: rf"{picture.estimator} $q_\eta(\theta\,|\,z)$",
        RECORDING_BOX: "$E_\\mathrm{obs}(s)$ (kPa)",
        OBSERVED_BOX: r"$z_\mathrm{obs}$",
        POSTERIOR_BOX: r"$q_\eta(\theta\,|\,z_\mathrm{obs})$",
        CHECK_BOX: "PPC (kPa)",
    }
    for box, title in titles.items():
        _text(figure, box.middle, box.bottom + box.height + TITLE_ABOVE_IN, title, fontsize=TITLE_PT)
    context = f"context $c_d$: {context_line(picture.context)}"
    _text(figure, 0.06, ROW_A - 0.30, context, fontsize=workflow_panels.SMALL_PT, ha="left")


def _short(name: str) -> str:
    """Return a name that leaves room for what stands beside it."""
    return name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}…"


def _connect(figure: Figure, picture: workflow_panels.WorkflowPicture) -> None:
    """Draw the arrows between neighbouring panels, and from the trained network to the posterior."""
    rows: Sequence[Sequence[tuple[Box, Box]]] = (
        ((PRIOR_BOX, CURVES_BOX), (CURVES_BOX, FEATURES_BOX), (FEATURES_BOX, TRAINING_BOX)),
        ((RECORDING_BOX, OBSERVED_BOX), (OBSERVED_BOX, POSTERIOR_BOX), (POSTERIOR_BOX, CHECK_BOX)),
    )
    summary = r"$S(\cdot)$, $c_d$"
    labels = (("0D model, $c_d$", summary, f"{picture.rows:,} rows"), (summary, "", "0D model"))
    for pairs, names in zip(rows, labels, strict=True):
        for (left, right), name in zip(pairs, names, strict=True):
            start, end = left.left + left.width, right.left
            y = left.bottom + left.height + ARROW_ABOVE_IN
            _arrow(figure, [(start, y), (end, y)])
            _text(figure, (start + end) / 2.0, y + 0.065, name, fontsize=workflow_panels.SMALL_PT)
    _connect_network(figure)


def _connect_network(figure: Figure) -> None:
    """Draw the arrow from the trained network, down between the rows, to the posterior."""
    turn = ROW_B + PANEL_HEIGHT_IN + HEAD_ABOVE_IN
    corners = [
        (TRAINING_BOX.middle, ROW_A - 0.27),
        (TRAINING_BOX.middle, turn),
        (POSTERIOR_BOX.middle, turn),
        (POSTERIOR_BOX.middle, ROW_B + PANEL_HEIGHT_IN + TITLE_ABOVE_IN + 0.08),
    ]
    _arrow(figure, corners)
    _text(
        figure,
        (TRAINING_BOX.middle + POSTERIOR_BOX.middle) / 2.0,
        turn + 0.065,
        "trained",
        fontsize=workflow_panels.SMALL_PT,
    )


def _axes(figure: Figure, box: Box) -> Axes:
    axes = figure.add_axes(_fractions(box))
    axes.tick_params(labelsize=workflow_panels.SMALL_PT, pad=1.2, length=1.8)
    return axes


def _stack(figure: Figure, box: Box) -> list[Axes]:
    """Return low axes one above the other within a box, one for the density of each parameter."""
    step = box.height / len(THETA)
    levels = reversed(range(len(THETA)))
    return [_axes(figure, Box(box.left, box.bottom + j * step, box.width, 0.55 * step)) for j in levels]


def _fractions(box: Box) -> tuple[float, float, float, float]:
    return (
        box.left / TEXT_WIDTH_IN,
        box.bottom / HEIGHT_IN,
        box.width / TEXT_WIDTH_IN,
        box.height / HEIGHT_IN,
    )


def _text(figure: Figure, x_in: float, y_in: float, text: str, **look: Any) -> None:  # noqa: ANN401
    if text:
        named = {"ha": "center", "va": "center", **look}
        figure.text(x_in / TEXT_WIDTH_IN, y_in / HEIGHT_IN, text, **named)


def _arrow(figure: Figure, corners_in: Sequence[tuple[float, float]]) -> None:
    """Draw an arrow along straight lines from corner to corner, in inches."""
    path = MplPath([(x / TEXT_WIDTH_IN, y / HEIGHT_IN) for x, y in corners_in])
    look: dict[str, Any] = {"arrowstyle": "-|>", "mutation_scale": 6.0, "lw": 0.8, "color": "black"}
    figure.add_artist(FancyArrowPatch(path=path, transform=figure.transFigure, **look))
