"""Predictive checks and posteriors, drawn for one subject and for a whole cohort."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from swesbi.artefacts.typed import ByPlace, BySubject, Place
from swesbi.checks.cmaes import CmaesFit
from swesbi.checks.predictive import PredictiveCheck
from swesbi.checks.truths import Truths
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.truncated import Posterior
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
from swesbi.report.figures.style import Drawing
from swesbi.verdict.verdict import Verdict


class CheckAndPosterior(NamedTuple):
    """Both figures."""

    ppc: Drawing
    posterior: Drawing


def subject_figures(
    predictive: PredictiveCheck,
    posterior: Posterior,
    verdict: Verdict,
    cmaes: CmaesFit,
    *,
    subject: str,
    cohort_title: str,
    prior: PriorSettings,
) -> CheckAndPosterior:
    """Draw predictive check and posterior of one subject; the prior is shown for scale."""
    panel = PosteriorPanel(subject, posterior.theta, posterior.unfiltered, cmaes.theta, verdict)
    return CheckAndPosterior(
        draw_subject_check(PredictivePanel(subject, predictive, cmaes, verdict), cohort_title),
        draw_subject_posterior(panel, prior, posterior.interval_mass, cohort_title),
    )


def exact_subject_figures(
    predictive: PredictiveCheck,
    posterior: ExactPosterior,
    verdict: Verdict,
    cmaes: CmaesFit,
    truth: Truths | None,
    *,
    subject: str,
    cohort_title: str,
    joint_prior: JointPriorSettings,
) -> CheckAndPosterior:
    """Draw predictive check and exact posterior of one subject; a recorded cohort has no known truth."""
    true = truth.get(subject) if truth else None
    panel = ExactPanel(subject, posterior, cmaes.theta, verdict, true)
    return CheckAndPosterior(
        draw_subject_check(PredictivePanel(subject, predictive, cmaes, verdict), cohort_title),
        draw_exact_subject(panel, joint_prior, cohort_title),
    )


def cohort_figures(
    predictives: ByPlace[PredictiveCheck],
    posteriors: ByPlace[Posterior],
    verdicts: ByPlace[Verdict],
    cmaes: BySubject[CmaesFit],
    *,
    cohort_title: str,
    prior: PriorSettings,
) -> CheckAndPosterior:
    """Draw predictive checks and posteriors of a cohort, subjects in the order of ``predictives``."""
    checks, panels, mass = [], [], 0.0
    for place, check, fit in _shown(predictives, verdicts, cmaes):
        draws = posteriors[place]
        checks.append(check)
        panels.append(PosteriorPanel(place.subject, draws.theta, draws.unfiltered, fit.theta, check.verdict))
        mass = draws.interval_mass
    return CheckAndPosterior(
        draw_cohort_checks(checks, cohort_title), draw_cohort_posteriors(panels, prior, mass, cohort_title)
    )


def exact_figures(
    predictives: ByPlace[PredictiveCheck],
    posteriors: ByPlace[ExactPosterior],
    verdicts: ByPlace[Verdict],
    cmaes: BySubject[CmaesFit],
    truth: Truths | None,
    *,
    cohort_title: str,
    joint_prior: JointPriorSettings,
) -> CheckAndPosterior:
    """Draw predictive checks and exact posteriors of a cohort, in the order of ``predictives``."""
    truths = truth or Truths()
    checks, panels = [], []
    for place, check, fit in _shown(predictives, verdicts, cmaes):
        checks.append(check)
        true = truths.get(place.subject)
        panels.append(ExactPanel(place.subject, posteriors[place], fit.theta, check.verdict, true))
    return CheckAndPosterior(
        draw_cohort_checks(checks, cohort_title), draw_exact_posteriors(panels, joint_prior, cohort_title)
    )


def _shown(
    predictives: ByPlace[PredictiveCheck], verdicts: ByPlace[Verdict], cmaes: BySubject[CmaesFit]
) -> Iterator[tuple[Place, PredictivePanel, CmaesFit]]:
    """Yield what the predictive check of each subject shows, and the reference fit."""
    for place, check in predictives.items():
        fit = cmaes[place.subject]
        yield place, PredictivePanel(place.subject, check, fit, verdicts[place]), fit
