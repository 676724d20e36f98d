"""Figures of the study: its workflow, its trainings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from swesbi.artefacts import Origin
from swesbi.base.settings import Settings
from swesbi.checks.predictive import read_predictive
from swesbi.networks.paper.pool import Pool, read_pool
from swesbi.posterior.truncated import Posterior, read_posterior
from swesbi.prior import PriorSettings
from swesbi.recording.observation import Observation
from swesbi.report.figures.style import save_figure
from swesbi.report.figures.training import draw_training, read_history
from swesbi.report.figures.workflow import draw_workflow
from swesbi.report.figures.workflow_panels import WorkflowPicture
from swesbi.study.stages.origin import ResultKey, by_key, pick
from swesbi.verdict.verdict import Verdict, read_verdict


class WorkflowFigureSettings(Settings):
    """What the figure calls the subjects and the estimator, and the prior it shows."""

    cohort_title: str
    prior: PriorSettings
    estimator: str


def workflow_figure(
    *,
    pool: Path,
    training: Path,
    observations: Sequence[Path],
    predictives: Sequence[Path],
    posteriors: Sequence[Path],
    verdicts: Sequence[Path],
    figure_pdf: Path,
    figure_png: Path,
    settings: WorkflowFigureSettings,
    origin: Origin,
) -> None:
    """Draw the workflow with the first subject of ``verdicts`` whose posterior may be interpreted.

    Where there is none the first one is shown, marked as excluded.

    Raises:
        ArtefactError: A file of the subject is missing, or cannot be read.
    """
    judged = {key: read_verdict(path) for key, path in by_key(verdicts).items()}
    key = shown_subject(judged)
    posterior = read_posterior(pick(by_key(posteriors), key, "posterior"))
    data, verdict = read_pool(pool), judged[key]
    rows = _rows_of(data, key.subject)
    contexts = {path.parent.name: path for path in observations}
    picture = WorkflowPicture(
        subject=key.subject,
        context=Observation.read(contexts[key.subject]).context,
        prior=settings.prior,
        check=read_predictive(pick(by_key(predictives), key, "predictive check"))[0],
        components=data.components.names,
        pool_z=data.z[rows].astype(np.float64),
        sample_z=data.z[rows & (data.draw_index == data.draw_index[rows].min())].astype(np.float64),
        z_obs=data.observed_z(key.subject),
        theta=_shown_draws(posterior, verdict),
        verdict=verdict,
        history=read_history(training),
        estimator=settings.estimator.upper(),
        subjects=len(data.subjects),
        rows=len(data.z),
    )
    save_figure(draw_workflow(picture, settings.cohort_title), figure_pdf, figure_png)


def shown_subject(verdicts: Mapping[ResultKey, Verdict]) -> ResultKey:
    """Return the first subject whose posterior may be interpreted, or the first where there is none.

    Raises:
        ValueError: There is no subject.
    """
    if not verdicts:
        raise ValueError("no subject to draw: the cohort is empty")
    return next((key for key, verdict in verdicts.items() if verdict.may_be_read), next(iter(verdicts)))


def _rows_of(pool: Pool, subject: str) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    return np.asarray(pool.subject_index == pool.subjects.index(subject))


def _shown_draws(posterior: Posterior, verdict: Verdict) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Return the posterior draws, or the finite unfiltered candidates of an excluded subject."""
    if verdict.may_be_read:
        return posterior.theta
    return posterior.unfiltered[np.all(np.isfinite(posterior.unfiltered), axis=1)]


class TrainingFigureSettings(Settings):
    """What the figure calls the subjects."""

    cohort_title: str


def training_figure(
    *,
    training: Path,
    figure_pdf: Path,
    figure_png: Path,
    settings: TrainingFigureSettings,
    origin: Origin,
) -> None:
    """Draw training and validation loss of an experiment's estimator, epoch by epoch."""
    history = read_history(training)
    save_figure(draw_training(history, settings.cohort_title), figure_pdf, figure_png)
