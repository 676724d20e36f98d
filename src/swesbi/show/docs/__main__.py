"""Command line: ``python -m swesbi.show.docs`` writes the marked parts of the documentation from results."""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from swesbi.artefacts import ArtefactError, atomic_path
from swesbi.config.read import ConfigError, add_options, read_merged
from swesbi.config.study import load_study
from swesbi.show.docs.calibration import PARTS as CALIBRATION_PARTS
from swesbi.show.docs.calibration import REFERENCE, experiment_shown, read_calibration_results
from swesbi.show.docs.exam import MARK, ExamResults, calibration_part, page_part, readme_part
from swesbi.show.docs.figures import write_noise_figure, write_population_figure
from swesbi.show.docs.ladder import PARTS as LADDER_PARTS
from swesbi.show.docs.ladder import LadderResults
from swesbi.show.docs.marks import MarkError, fill
from swesbi.show.docs.population import PARTS as POPULATION_PARTS
from swesbi.show.docs.population import read_population_results
from swesbi.show.docs.readings import PARTS as READINGS_PARTS
from swesbi.show.docs.readings import ReadingsResults
from swesbi.show.docs.reproduction import PARTS
from swesbi.show.docs.results import read_results
from swesbi.show.page.figures import PagePart, figures_of

PAGE: Final = "reproduction.md"
CALIBRATION_PAGE: Final = "calibration.md"
POPULATION_PAGE: Final = "population.md"
LADDER_PAGE: Final = "ladder.md"
READINGS_PAGE: Final = "readings.md"
EXAM_PAGE: Final = "exam.md"
README: Final = "../README.md"
EXIT_USAGE: Final = 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the documentation's marked parts and figures; return 0, or 2 with a message."""
    parser = argparse.ArgumentParser(
        prog="python -m swesbi.show.docs",
        description="Rewrite the marked parts of the pages under docs/ and of the README beside it, and copy "
        "the figures that the documentation shows, from a finished study.",
    )
    add_options(parser)
    parser.add_argument("--docs", type=Path, default=Path("docs"), help="default: docs")
    given = parser.parse_args(arguments)
    try:
        write_docs(given.config, given.overlay, given.docs)
    except (ArtefactError, ConfigError, MarkError, FileNotFoundError) as error:
        print(f"swesbi: {error}", file=sys.stderr)
        return EXIT_USAGE
    return 0


def write_docs(config: Path, changes: Path | None, docs: Path) -> None:
    """Write the pages and copy the figures; the results' folder is the configuration's.

    The pages on experiments on speeds and over a population are written where the study runs one.

    Raises:
        ArtefactError: The study is not finished.
        ConfigError: The configuration is not valid.
        MarkError: A page's marks do not fit.
        FileNotFoundError: A page or a figure does not exist.
    """
    study = load_study(read_merged(config, changes), str(config))
    folder = Path(study.config.results)
    results = read_results(folder, study)
    pages = {PAGE: {name: part(results) for name, part in PARTS.items()}}
    ladder = LadderResults.read(REFERENCE)
    pages[LADDER_PAGE] = {mark: part(ladder) for mark, part in LADDER_PARTS.items()}
    readings = ReadingsResults.read(docs / "tables")
    pages[READINGS_PAGE] = {mark: part(readings) for mark, part in READINGS_PARTS.items()}
    exam = ExamResults.read(docs / "tables", study.config.exam_interval)
    pages |= {EXAM_PAGE: {MARK: page_part(exam)}, README: {MARK: readme_part(exam)}}
    figures = documented(PagePart.STUDY)
    if name := experiment_shown(study):
        text = config.read_text(encoding="utf-8")
        calibration = read_calibration_results(folder, study, name, docs, text)
        pages[CALIBRATION_PAGE] = {mark: part(calibration) for mark, part in CALIBRATION_PARTS.items()}
        pages[CALIBRATION_PAGE] |= {MARK: calibration_part(exam)}
        figures += [*documented(PagePart.SPEEDS, name), f"training-{name}"]
        write_noise_figure(folder / "cohort" / "noise.h5", docs, study.config.cohort_title)
    for name in study.config.populations_run[:1]:
        population = read_population_results(folder, study, name, docs)
        pages[POPULATION_PAGE] = {mark: part(population) for mark, part in POPULATION_PARTS.items()}
        figures += documented(PagePart.POPULATION, name)
        figures += [f"pressures-{name}"] if study.with_pressures(name) else []
        write_population_figure(study, name, docs)
    texts = {page: fill((docs / page).read_text(encoding="utf-8"), parts) for page, parts in pages.items()}
    for figure in figures:
        with atomic_path(docs / "figures" / f"{figure}.png") as temporary:
            shutil.copyfile(folder / "figures" / f"{figure}.png", temporary)
    for page, text in texts.items():
        with atomic_path(docs / page) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="\n")


def documented(part: PagePart, experiment: str = "") -> list[str]:
    """Return the names of the files of figures that the documentation copies from a part of the page."""
    return [spec.stem(experiment) for spec in figures_of(part).values() if spec.documented]


if __name__ == "__main__":
    sys.exit(main())
