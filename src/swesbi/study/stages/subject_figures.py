"""Predictive checks and posteriors, drawn for one subject and for a whole cohort."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from swesbi.base import Settings
from swesbi.checks.cmaes import read_cmaes
from swesbi.checks.predictive import read_predictive
from swesbi.checks.recovery import read_truth
from swesbi.posterior.result import read_exact_result
from swesbi.posterior.truncated import read_posterior
from swesbi.prior import JointPriorSettings, PriorSettings
from swesbi.show.figures.posterior import draw_cohort_posteriors, draw_exact_posteriors
from swesbi.show.figures.posterior_subject import draw_exact_subject, draw_subject_posterior
from swesbi.show.figures.predictive import (
    ExactPanel,
    PosteriorPanel,
    PredictivePanel,
    draw_cohort_checks,
    draw_subject_check,
)
from swesbi.show.figures.style import save_figure
from swesbi.study.stages.origin import Origin, by_place, by_subject, pick
from swesbi.verdict.support import read_support


class SubjectFiguresSettings(Settings):
    """What the figures call the subjects, and the prior shown for scale."""

    cohort_title: str
    prior: PriorSettings


def subject_figures(
    *,
    predictive: Path,
    posterior: Path,
    support: Path,
    cmaes: Path,
    ppc_png: Path,
    posterior_png: Path,
    settings: SubjectFiguresSettings,
    origin: Origin,
) -> None:
    """Draw predictive check and posterior."""
    save_predictive_check(predictive, support, cmaes, ppc_png, settings.cohort_title)
    draws = read_posterior(posterior)
    fit, provenance = read_cmaes(cmaes)
    panel = PosteriorPanel(
        provenance.subject, draws.theta, draws.unfiltered, fit.theta, read_support(support)
    )
    drawn = draw_subject_posterior(panel, settings.prior, draws.interval_mass, settings.cohort_title)
    save_figure(drawn, posterior_png)


def save_predictive_check(
    predictive: Path, support: Path, cmaes: Path, figure: Path, cohort_title: str
) -> None:
    """Draw the predictive check of any experiment; ``figure`` is a .png or .pdf."""
    check, provenance = read_predictive(predictive)
    fit, _ = read_cmaes(cmaes)
    panel = PredictivePanel(provenance.subject, check, fit, read_support(support))
    save_figure(draw_subject_check(panel, cohort_title), figure)


class ExactSubjectFiguresSettings(Settings):
    """What the figures call the subjects, and the joint prior shown for scale."""

    cohort_title: str
    prior: JointPriorSettings


def exact_subject_figures(
    *,
    predictive: Path,
    posterior: Path,
    support: Path,
    cmaes: Path,
    truth: Sequence[Path],
    ppc_png: Path,
    posterior_png: Path,
    settings: ExactSubjectFiguresSettings,
    origin: Origin,
) -> None:
    """Draw predictive check and posterior.

    ``truth`` is the file of true parameters of a generated cohort, or nothing.
    """
    save_predictive_check(predictive, support, cmaes, ppc_png, settings.cohort_title)
    save_exact_posterior(posterior, support, cmaes, truth, posterior_png, settings)


def save_exact_posterior(
    posterior: Path,
    support: Path,
    cmaes: Path,
    truth: Sequence[Path],
    figure: Path,
    settings: ExactSubjectFiguresSettings,
) -> None:
    """Draw the exact posterior; ``figure`` is a .png or .pdf, ``truth`` as in ``run``."""
    fit, provenance = read_cmaes(cmaes)
    subject = provenance.subject
    panel = ExactPanel(
        subject=subject,
        result=read_exact_result(posterior),
        fit_theta=fit.theta,
        support=read_support(support),
        truth=read_truth(truth).get(subject),
    )
    save_figure(draw_exact_subject(panel, settings.prior, settings.cohort_title), figure)


class CohortFiguresSettings(Settings):
    """What the figures call the subjects, and the prior shown for scale."""

    cohort_title: str
    prior: PriorSettings


def cohort_figures(
    *,
    predictives: Sequence[Path],
    posteriors: Sequence[Path],
    supports: Sequence[Path],
    cmaes: Sequence[Path],
    ppc_pdf: Path,
    ppc_png: Path,
    posterior_pdf: Path,
    posterior_png: Path,
    settings: CohortFiguresSettings,
    origin: Origin,
) -> None:
    """Draw both figures of one experiment, subjects in the order of ``predictives``."""
    support_of, posterior_of, fit_of = by_place(supports), by_place(posteriors), by_subject(cmaes)
    checks, marginals, interval = [], [], 0.0
    for place, path in by_place(predictives).items():
        support = read_support(pick(support_of, place, "support verdict"))
        fit, _ = read_cmaes(fit_of[place.subject])
        posterior = read_posterior(pick(posterior_of, place, "posterior"))
        interval = posterior.interval_mass
        checks.append(PredictivePanel(place.subject, read_predictive(path)[0], fit, support))
        marginals.append(
            PosteriorPanel(place.subject, posterior.theta, posterior.unfiltered, fit.theta, support)
        )
    title = settings.cohort_title
    save_figure(draw_cohort_checks(checks, title), ppc_pdf, ppc_png)
    save_figure(
        draw_cohort_posteriors(marginals, settings.prior, interval, title), posterior_pdf, posterior_png
    )


class ExactFiguresSettings(ExactSubjectFiguresSettings):
    """What the figures call the subjects, and the joint prior shown for scale."""


def exact_figures(
    *,
    predictives: Sequence[Path],
    posteriors: Sequence[Path],
    supports: Sequence[Path],
    cmaes: Sequence[Path],
    truth: Sequence[Path],
    ppc_pdf: Path,
    ppc_png: Path,
    posterior_pdf: Path,
    posterior_png: Path,
    settings: ExactFiguresSettings,
    origin: Origin,
) -> None:
    """Draw both figures of one experiment, subjects in the order of ``predictives``.

    ``truth`` is the file of true parameters of a generated cohort, or nothing.
    """
    support_of, posterior_of, fit_of = by_place(supports), by_place(posteriors), by_subject(cmaes)
    truths = read_truth(truth)
    checks, marginals = [], []
    for place, path in by_place(predictives).items():
        support = read_support(pick(support_of, place, "support verdict"))
        fit, _ = read_cmaes(fit_of[place.subject])
        result = read_exact_result(pick(posterior_of, place, "posterior"))
        checks.append(PredictivePanel(place.subject, read_predictive(path)[0], fit, support))
        true_phi = truths.get(place.subject)
        marginals.append(ExactPanel(place.subject, result, fit.theta, support, true_phi))
    title = settings.cohort_title
    save_figure(draw_cohort_checks(checks, title), ppc_pdf, ppc_png)
    save_figure(draw_exact_posteriors(marginals, settings.prior, title), posterior_pdf, posterior_png)
