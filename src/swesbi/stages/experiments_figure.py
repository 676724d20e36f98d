"""Stage: the experiments beside each other, subject by subject."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from swesbi.evaluation.predictive_dataset import read_predictive
from swesbi.inference.dataset import read_posterior
from swesbi.inference.support import read_support
from swesbi.settings import Settings
from swesbi.show.figures.experiments import ExperimentScore, draw_experiments
from swesbi.show.figures.style import save_figure
from swesbi.stages.origin import Origin
from swesbi.stages.places import Place, by_place, pick
from swesbi.theta import THETA_NAMES

K_ATP = THETA_NAMES.index("k_atp_per_s")


class ExperimentsFigureSettings(Settings):
    """What the figure calls the subjects, and the experiment with which the others are compared."""

    cohort_title: str
    main_experiment: str


def run(
    *,
    predictives: Sequence[Path],
    posteriors: Sequence[Path],
    supports: Sequence[Path],
    figure_pdf: Path,
    figure_png: Path,
    settings: ExperimentsFigureSettings,
    origin: Origin,
) -> None:
    """Draw RMSE, coverage and k_ATP of every experiment and subject, in the order of ``predictives``.

    Raises:
        ArtefactError: A subject's posterior or verdict is missing, or a file cannot be read.
    """
    posterior_of, support_of = by_place(posteriors), by_place(supports)
    scores = [
        _score(
            place, path, pick(posterior_of, place, "posterior"), pick(support_of, place, "support verdict")
        )
        for place, path in by_place(predictives).items()
    ]
    masses = (read_predictive(predictives[0])[0].interval, read_posterior(posteriors[0]).interval_mass)
    figure = draw_experiments(scores, settings.main_experiment, masses, settings.cohort_title)
    save_figure(figure, figure_pdf, figure_png)


def _score(place: Place, predictive: Path, posterior: Path, support: Path) -> ExperimentScore:
    check, verdict, draws = read_predictive(predictive)[0], read_support(support), read_posterior(posterior)
    low, high = map(float, draws.interval[K_ATP])
    return ExperimentScore(
        experiment=place.experiment,
        subject=place.subject,
        supported=verdict.supported,
        rmse_kpa=check.posterior.scores.rmse_kpa,
        prior_rmse_kpa=check.prior.scores.rmse_kpa,
        coverage=check.posterior.scores.coverage,
        coverage_phases=check.posterior.phase_scores.coverage,
        k_atp_per_s=(low, float(draws.median[K_ATP]), high),
        unfiltered_k_atp_per_s=verdict.unfiltered_median["k_atp_per_s"],
    )
