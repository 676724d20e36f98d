"""The figures that pages show and no stage of the study draws."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from matplotlib.figure import Figure

from swesbi.config.study import Study
from swesbi.population.contexts import draw_population
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.speed import NoiseComponents
from swesbi.report.figures import recording
from swesbi.virtual.volunteers import VOLUNTEERS
from tools.docs.drawings import method_figure, push_figure
from tools.docs.first_figure import first_figure
from tools.docs.population_figure import population_figure

CONTEXTS: Final = 20_000
"""As many as the page says."""


def noise_figure(study: Study) -> Figure:
    """Return the cohort's noise; with the truth where all are virtual volunteers."""
    estimates = CohortNoise.read(Path(study.config.results) / "cohort/noise.h5")
    acquired = {each.context.subject: each.acquisition for each in VOLUNTEERS}
    made_with = {
        name: NoiseComponents(own.repeat_sd_fraction, own.sample_sd_fraction, own.sweep_fraction)
        for name, own in acquired.items()
    }
    virtual = made_with.keys() >= set(estimates.group_of)
    truth = made_with if virtual else None
    return recording.noise_figure(estimates, cohort_title=study.config.cohort_title, truth=truth)


def contexts_figure(study: Study) -> Figure:
    """Return contexts of the first population that is run, with the cohort marked."""
    population = study.config.population_experiments[study.config.populations_run[0]].population
    drawn = draw_population(range(CONTEXTS), population, study.config.seed, "documentation")
    shown = [row.to_context() for row in study.cohort.rows.values()]
    return population_figure(drawn, shown, population.declared_range, study.config.cohort_title)


DRAWN: Final[Mapping[str, Callable[[Study], Figure]]] = {
    "first": first_figure,
    "method": method_figure,
    "noise": noise_figure,
    "population": contexts_figure,
    "push": push_figure,
}
