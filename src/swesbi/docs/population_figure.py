"""The figure of whom a population holds, as the documentation shows it."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from swesbi.config import Study
from swesbi.figures.population import population_figure
from swesbi.figures.style import save_figure
from swesbi.population.contexts import draw_population

CONTEXTS: Final = 20_000
"""As many as the page says."""


def write_population_figure(study: Study, name: str, docs: Path) -> None:
    """Draw contexts of an experiment's population, with the cohort marked, into ``docs/figures``."""
    population = study.config.population_experiments[name].population
    drawn = draw_population(range(CONTEXTS), population, study.config.seed, "documentation")
    shown = [row.to_context() for row in study.context_rows.values()]
    figure = population_figure(drawn, shown, population.declared_range, study.config.cohort_title)
    save_figure(figure, docs / "figures" / "population.png")
