"""Predictive checks and posteriors, drawn for one subject and for a whole cohort."""

from __future__ import annotations

from typing import NamedTuple

from swesbi.artefacts.typed import ByPlace, BySubject
from swesbi.checks.cmaes import CmaesFit
from swesbi.checks.predictive import PredictiveCheck
from swesbi.checks.truths import Truths
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.truncated import Posterior
from swesbi.prior import JointPriorSettings, PriorSettings
from swesbi.report.figures.posterior import PosteriorPanel, draw_corner, draw_posteriors
from swesbi.report.figures.predictive import PredictivePanel, draw_cohort_checks, draw_subject_check
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
    return _of_subject(predictive, posterior, verdict, cmaes, None, subject, prior, cohort_title)


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
    return _of_subject(predictive, posterior, verdict, cmaes, truth, subject, joint_prior, cohort_title)


def _of_subject(
    predictive: PredictiveCheck,
    posterior: Posterior | ExactPosterior,
    verdict: Verdict,
    cmaes: CmaesFit,
    truth: Truths | None,
    subject: str,
    prior: PriorSettings | JointPriorSettings,
    title: str,
) -> CheckAndPosterior:
    true = truth.get(subject) if truth else None
    panel = PosteriorPanel.of(subject, posterior, verdict, cmaes.theta, true)
    check = PredictivePanel(subject, predictive, cmaes, verdict)
    return CheckAndPosterior(draw_subject_check(check, title), draw_corner(panel, prior, title))


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
    return _of_cohort(predictives, posteriors, verdicts, cmaes, None, prior, cohort_title)


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
    return _of_cohort(predictives, posteriors, verdicts, cmaes, truth, joint_prior, cohort_title)


def _of_cohort(
    predictives: ByPlace[PredictiveCheck],
    posteriors: ByPlace[Posterior] | ByPlace[ExactPosterior],
    verdicts: ByPlace[Verdict],
    cmaes: BySubject[CmaesFit],
    truth: Truths | None,
    prior: PriorSettings | JointPriorSettings,
    title: str,
) -> CheckAndPosterior:
    """Draw the predictive check of each subject, with the reference fit, and the posteriors."""
    checks, panels, truths = [], [], truth or Truths()
    for place, check in predictives.items():
        subject, verdict, fit = place.subject, verdicts[place], cmaes[place.subject]
        true = truths.get(subject)
        checks.append(PredictivePanel(subject, check, fit, verdict))
        panels.append(PosteriorPanel.of(subject, posteriors[place], verdict, fit.theta, true))
    return CheckAndPosterior(draw_cohort_checks(checks, title), draw_posteriors(panels, prior, title))
