"""The figures that pages show and no stage of the study draws."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from matplotlib.figure import Figure

from swesbi.config.study import Study
from swesbi.population.contexts import draw_population
from swesbi.recording.speed import NoiseComponents
from swesbi.report.figures.population import population_figure
from swesbi.report.figures.recording import draw_noise
from swesbi.study.results import Results
from swesbi.virtual.volunteers import VOLUNTEERS
from tools.docs.first_figure import first_figure

CONTEXTS: Final = 20_000
"""As many as the page says."""


def noise_figure(study: Study) -> Figure:
    """Return the cohort's noise; with the truth where all are virtual volunteers.

    Raises:
        ArtefactError: The study is not finished.
    """
    estimates = Results(Path(study.config.results)).noise
    acquired = {each.context.subject: each.acquisition for each in VOLUNTEERS}
    made_with = {
        name: NoiseComponents(own.repeat_sd_fraction, own.sample_sd_fraction, own.sweep_fraction)
        for name, own in acquired.items()
    }
    virtual = made_with.keys() >= set(estimates.group_of)
    return draw_noise(estimates, study.config.cohort_title, made_with if virtual else None)


def contexts_figure(study: Study) -> Figure:
    """Return contexts of the first population that is run, with the cohort marked."""
    population = study.config.population_experiments[study.config.populations_run[0]].population
    drawn = draw_population(range(CONTEXTS), population, study.config.seed, "documentation")
    shown = [row.to_context() for row in study.cohort.rows.values()]
    return population_figure(drawn, shown, population.declared_range, study.config.cohort_title)


DRAWN: Final[Mapping[str, Callable[[Study], Figure]]] = {
    "first": first_figure,
    "noise": noise_figure,
    "population": contexts_figure,
}
