"""The figures that the documentation draws itself: noise beside its truth, and whom a population holds."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from swesbi.config.study import Study
from swesbi.population.contexts import draw_population
from swesbi.recording.acquisition_settings import ACQUISITION
from swesbi.recording.noise import read_noise
from swesbi.recording.speed import NoiseComponents
from swesbi.report.figures.population import population_figure
from swesbi.report.figures.recording import draw_noise
from swesbi.report.figures.style import save_figure
from swesbi.virtual.volunteers import VOLUNTEERS

CONTEXTS: Final = 20_000
"""As many as the page says."""


def write_noise_figure(noise: Path, docs: Path, cohort_title: str) -> None:
    """Draw the cohort's noise into ``docs/figures``; with the truth where all are virtual volunteers.

    Raises:
        ArtefactError: There is no such artefact.
    """
    estimates = read_noise(noise)
    virtual = {volunteer.context.subject for volunteer in VOLUNTEERS} >= set(estimates.by_subject)
    made_with = NoiseComponents(
        ACQUISITION.repeat_sd_fraction, ACQUISITION.sample_sd_fraction, ACQUISITION.sweep_fraction
    )
    figure = draw_noise(estimates, cohort_title, made_with if virtual else None)
    save_figure(figure, docs / "figures" / "noise.png")


def write_population_figure(study: Study, name: str, docs: Path) -> None:
    """Draw contexts of an experiment's population, with the cohort marked, into ``docs/figures``."""
    population = study.config.population_experiments[name].population
    drawn = draw_population(range(CONTEXTS), population, study.config.seed, "documentation")
    shown = [row.to_context() for row in study.context_rows.values()]
    figure = population_figure(drawn, shown, population.declared_range, study.config.cohort_title)
    save_figure(figure, docs / "figures" / "population.png")
