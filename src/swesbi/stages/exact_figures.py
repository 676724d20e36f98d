"""Stage: predictive checks and exact posteriors of a whole cohort in one experiment on speeds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from swesbi.evaluation.cmaes_dataset import read_cmaes
from swesbi.evaluation.exact_result import read_exact_result
from swesbi.evaluation.predictive_dataset import read_predictive
from swesbi.evaluation.truth import read_truth
from swesbi.inference.support import read_support
from swesbi.show.figures.posterior import draw_exact_posteriors
from swesbi.show.figures.predictive import ExactPanel, PredictivePanel, draw_cohort_checks
from swesbi.show.figures.style import save_figure
from swesbi.stages.exact_subject_figures import ExactSubjectFiguresSettings
from swesbi.stages.origin import Origin
from swesbi.stages.places import by_place, by_subject, pick


class ExactFiguresSettings(ExactSubjectFiguresSettings):
    """What the figures call the subjects, and the joint prior shown for scale."""


def run(
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
