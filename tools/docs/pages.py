"""The marked parts of every page, by page and mark: of stored tables and a finished study."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from swesbi.config.study import Study
from tools.docs.calibration import PARTS as CALIBRATION_PARTS
from tools.docs.calibration import experiment_shown, read_calibration_results
from tools.docs.population import PARTS as POPULATION_PARTS
from tools.docs.population import read_population_results
from tools.docs.pushes import MARK as FREE_RUNNING
from tools.docs.pushes import PushesResults, pushes_part
from tools.docs.reproduction import PARTS
from tools.docs.results import read_results

PAGE: Final = "reproduction.md"
CALIBRATION_PAGE: Final = "calibration.md"
POPULATION_PAGE: Final = "population.md"

Pages = dict[str, dict[str, str]]
"""Texts of marked parts, by page relative to the documentation's folder, then by mark."""


def stored_pages(study: Study, docs: Path) -> Pages:
    """Return the parts that are made of stored tables, whatever has been run here.

    Raises:
        ArtefactError: A stored table is not what its name says.
    """
    pages: Pages = {}
    for name in study.config.populations_run[:1]:
        base = study.config.speed_experiments[study.config.base_of(name)]
        pushes = PushesResults.read(docs / "tables", base.exact.interval)
        pages[POPULATION_PAGE] = {FREE_RUNNING: pushes_part(pushes)}
    return pages


def study_pages(study: Study, docs: Path) -> Pages:
    """Return the parts that are made of a finished study's results.

    The pages on experiments on speeds and over a population are among them where the study runs one.

    Args:
        study: Configuration, which names the folder of the results, and cohort.
        docs: Folder of the documentation, which holds tables of its own.

    Raises:
        ArtefactError: The study is not finished.
    """
    folder = Path(study.config.results)
    results = read_results(folder, study, docs)
    pages = {PAGE: {mark: part(results) for mark, part in PARTS.items()}}
    if name := experiment_shown(study):
        calibration = read_calibration_results(folder, study, name, docs)
        pages[CALIBRATION_PAGE] = {mark: part(calibration) for mark, part in CALIBRATION_PARTS.items()}
    for name in study.config.populations_run[:1]:
        population = read_population_results(folder, study, name, docs)
        pages[POPULATION_PAGE] = {mark: part(population) for mark, part in POPULATION_PARTS.items()}
    return pages


def together(first: Pages, second: Pages) -> Pages:
    """Return the parts of both, page by page."""
    return {page: first.get(page, {}) | second.get(page, {}) for page in (*first, *second)}
