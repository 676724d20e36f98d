"""Predictive checks and posteriors, drawn for one subject and for a whole cohort."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from swesbi.artefacts import Origin
from swesbi.base.settings import Settings
from swesbi.checks.cmaes import CmaesFit
from swesbi.checks.predictive import read_predictive
from swesbi.checks.recovery import read_truth
from swesbi.posterior.result import read_exact_posterior
from swesbi.posterior.truncated import Posterior, read_posterior
from swesbi.prior import JointPriorSettings, PriorSettings
from swesbi.report.figures.posterior import draw_cohort_posteriors, draw_exact_posteriors
from swesbi.report.figures.posterior_subject import draw_exact_subject, draw_subject_posterior
from swesbi.report.figures.predictive import (
    ExactPanel,
    PosteriorPanel,
    PredictivePanel,
    draw_cohort_checks,
    draw_subject_check,
)
from swesbi.report.figures.style import save_figure
from swesbi.study.stages.origin import by_key, by_subject, pick
from swesbi.verdict.verdict import Verdict, read_verdict


class SubjectFiguresSettings(Settings):
    """What the figures call the subjects, and the prior shown for scale."""

    cohort_title: str
    prior: PriorSettings


def subject_figures(
    *,
    predictive: Path,
    posterior: Path,
    verdict: Path,
    cmaes: Path,
    ppc_png: Path,
    posterior_png: Path,
    settings: SubjectFiguresSettings,
    origin: Origin,
) -> None:
    """Draw predictive check and posterior of one subject."""
    _save_predictive_check(predictive, verdict, cmaes, ppc_png, settings.cohort_title)
    draws, fit = read_posterior(posterior), CmaesFit.read(cmaes)
    panel = _posterior_panel(origin.subject, draws, fit, read_verdict(verdict))
    drawn = draw_subject_posterior(panel, settings.prior, draws.interval_mass, settings.cohort_title)
    save_figure(drawn, posterior_png)


def _save_predictive_check(
    predictive: Path, verdict: Path, cmaes: Path, figure: Path, cohort_title: str
) -> None:
    """Draw the predictive check of any experiment."""
    check, provenance = read_predictive(predictive)
    panel = PredictivePanel(provenance.subject, check, CmaesFit.read(cmaes), read_verdict(verdict))
    save_figure(draw_subject_check(panel, cohort_title), figure)


def _posterior_panel(subject: str, draws: Posterior, fit: CmaesFit, verdict: Verdict) -> PosteriorPanel:
    return PosteriorPanel(subject, draws.theta, draws.unfiltered, fit.theta, verdict)


class ExactSubjectFiguresSettings(Settings):
    """What the figures call the subjects, and the joint prior shown for scale."""

    cohort_title: str
    prior: JointPriorSettings


def exact_subject_figures(
    *,
    predictive: Path,
    posterior: Path,
    verdict: Path,
    cmaes: Path,
    truth: Sequence[Path],
    ppc_png: Path,
    posterior_png: Path,
    settings: ExactSubjectFiguresSettings,
    origin: Origin,
) -> None:
    """Draw predictive check and exact posterior of one subject.

    ``truth`` is the file of true parameters of a generated cohort, or nothing.
    """
    _save_predictive_check(predictive, verdict, cmaes, ppc_png, settings.cohort_title)
    result, fit = read_exact_posterior(posterior), CmaesFit.read(cmaes)
    subject, judged = origin.subject, read_verdict(verdict)
    panel = ExactPanel(subject, result, fit.theta, judged, read_truth(truth).get(subject))
    save_figure(draw_exact_subject(panel, settings.prior, settings.cohort_title), posterior_png)


class CohortFiguresSettings(Settings):
    """What the figures call the subjects, and the prior shown for scale."""

    cohort_title: str
    prior: PriorSettings


def cohort_figures(
    *,
    predictives: Sequence[Path],
    posteriors: Sequence[Path],
    verdicts: Sequence[Path],
    cmaes: Sequence[Path],
    ppc_pdf: Path,
    ppc_png: Path,
    posterior_pdf: Path,
    posterior_png: Path,
    settings: CohortFiguresSettings,
    origin: Origin,
) -> None:
    """Draw predictive checks and posteriors of a cohort, subjects in the order of ``predictives``."""
    results = [
        (panel, fit, read_posterior(path))
        for panel, fit, path in _results(predictives, posteriors, verdicts, cmaes)
    ]
    title = settings.cohort_title
    save_figure(draw_cohort_checks([panel for panel, _, _ in results], title), ppc_pdf, ppc_png)
    panels = [_posterior_panel(panel.subject, draws, fit, panel.verdict) for panel, fit, draws in results]
    drawn = draw_cohort_posteriors(panels, settings.prior, results[-1][2].interval_mass, title)
    save_figure(drawn, posterior_pdf, posterior_png)


def _results(
    predictives: Sequence[Path], posteriors: Sequence[Path], verdicts: Sequence[Path], cmaes: Sequence[Path]
) -> Iterator[tuple[PredictivePanel, CmaesFit, Path]]:
    """Read what the predictive check of each subject shows; yield it with the fit and the posterior's path.

    Raises:
        ArtefactError: A subject's posterior or verdict is missing, or a file cannot be read.
    """
    verdict_of, posterior_of, fit_of = by_key(verdicts), by_key(posteriors), by_subject(cmaes)
    for key, path in by_key(predictives).items():
        verdict = read_verdict(pick(verdict_of, key, "verdict"))
        fit = CmaesFit.read(fit_of[key.subject])
        panel = PredictivePanel(key.subject, read_predictive(path)[0], fit, verdict)
        yield panel, fit, pick(posterior_of, key, "posterior")


class ExactFiguresSettings(ExactSubjectFiguresSettings):
    """What the figures call the subjects, and the joint prior shown for scale."""


def exact_figures(
    *,
    predictives: Sequence[Path],
    posteriors: Sequence[Path],
    verdicts: Sequence[Path],
    cmaes: Sequence[Path],
    truth: Sequence[Path],
    ppc_pdf: Path,
    ppc_png: Path,
    posterior_pdf: Path,
    posterior_png: Path,
    settings: ExactFiguresSettings,
    origin: Origin,
) -> None:
    """Draw predictive checks and exact posteriors of a cohort, in the order of ``predictives``.

    ``truth`` is the file of true parameters of a generated cohort, or nothing.
    """
    truths, checks, panels = read_truth(truth), [], []
    for panel, fit, path in _results(predictives, posteriors, verdicts, cmaes):
        checks.append(panel)
        result, subject = read_exact_posterior(path), panel.subject
        panels.append(ExactPanel(subject, result, fit.theta, panel.verdict, truths.get(subject)))
    title = settings.cohort_title
    save_figure(draw_cohort_checks(checks, title), ppc_pdf, ppc_png)
    save_figure(draw_exact_posteriors(panels, settings.prior, title), posterior_pdf, posterior_png)
