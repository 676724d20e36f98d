"""Stage: figures 2 and 3, the predictive checks and the posteriors of a whole cohort in one experiment."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from swesbi.evaluation.cmaes_dataset import read_cmaes
from swesbi.evaluation.predictive_dataset import read_predictive
from swesbi.inference.dataset import read_posterior
from swesbi.inference.support import read_support
from swesbi.settings import Settings
from swesbi.show.figures.posterior import draw_cohort_posteriors
from swesbi.show.figures.predictive import PosteriorPanel, PredictivePanel, draw_cohort_checks
from swesbi.show.figures.style import save_figure
from swesbi.simulations.prior import PriorSettings
from swesbi.stages.origin import Origin
from swesbi.stages.places import by_place, by_subject, pick


class CohortFiguresSettings(Settings):
    """What the figures call the subjects, and the prior shown for scale."""

    cohort_title: str
    prior: PriorSettings


def run(
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
