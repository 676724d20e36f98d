"""Predictive checks and posteriors, drawn for one subject and for a whole cohort."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from swesbi.artefacts.typed import ByPlace, BySubject
from swesbi.checks.cmaes import CmaesFit
from swesbi.checks.predictive import PredictiveCheck
from swesbi.checks.truths import Truths
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.truncated import Posterior
from swesbi.prior import JointPriorSettings, PriorSettings
from swesbi.report.figures.posterior import PosteriorPanel, draw_posteriors
from swesbi.report.figures.posterior_subject import draw_corner
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
    panel = PosteriorPanel.of_features(subject, posterior, verdict, cmaes.theta)
    return CheckAndPosterior(
        draw_subject_check(PredictivePanel(subject, predictive, cmaes, verdict), cohort_title),
        draw_corner(panel, prior, cohort_title),
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
    panel = PosteriorPanel.of_speeds(subject, posterior, verdict, cmaes.theta, true)
    return CheckAndPosterior(
        draw_subject_check(PredictivePanel(subject, predictive, cmaes, verdict), cohort_title),
        draw_corner(panel, joint_prior, cohort_title),
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
    panels = [
        PosteriorPanel.of_features(
            place.subject, posteriors[place], verdicts[place], cmaes[place.subject].theta
        )
        for place in predictives
    ]
    return _of_cohort(predictives, verdicts, cmaes, panels, prior, cohort_title)


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
    panels = [
        PosteriorPanel.of_speeds(
            place.subject,
            posteriors[place],
            verdicts[place],
            cmaes[place.subject].theta,
            truths.get(place.subject),
        )
        for place in predictives
    ]
    return _of_cohort(predictives, verdicts, cmaes, panels, joint_prior, cohort_title)


def _of_cohort(
    predictives: ByPlace[PredictiveCheck],
    verdicts: ByPlace[Verdict],
    cmaes: BySubject[CmaesFit],
    panels: Sequence[PosteriorPanel],
    prior: PriorSettings | JointPriorSettings,
    title: str,
) -> CheckAndPosterior:
    """Draw the predictive check of each subject, with the reference fit, and the posteriors."""
    checks = [
        PredictivePanel(place.subject, check, cmaes[place.subject], verdicts[place])
        for place, check in predictives.items()
    ]
    return CheckAndPosterior(draw_cohort_checks(checks, title), draw_posteriors(panels, prior, title))
