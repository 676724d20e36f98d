"""Command line: ``python -m tools.docs`` writes the marked parts of documentation from results."""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from swesbi.artefacts import ArtefactError, atomic_path
from swesbi.config.read import ConfigError, add_options, parsed, read_merged
from swesbi.config.study import Study, load_study
from swesbi.report.page.figures import PagePart, figures_of
from tools.docs.calibration import experiment_shown
from tools.docs.figures import write_noise_figure, write_population_figure
from tools.docs.marks import MarkError, fill, standing
from tools.docs.pages import stored_pages, study_pages, together

EXIT_USAGE: Final = 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the documentation's marked parts and figures; return 0, or 2 with a message."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.docs",
        description="Rewrite the marked parts of the pages under docs/, and copy "
        "the figures that the documentation shows, from a finished study.",
    )
    add_options(parser)
    parser.add_argument("--docs", type=Path, default=Path("docs"), help="default: docs")
    parser.add_argument(
        "--stored",
        action="store_true",
        help="only the parts made of stored tables and of settings: no study is needed",
    )
    try:
        given = parsed(parser, sys.argv[1:] if arguments is None else arguments)
        write_docs(given.config, given.overlay, given.docs, stored=given.stored)
    except (ArtefactError, ConfigError, MarkError, FileNotFoundError) as error:
        print(f"swesbi: {error}", file=sys.stderr)
        return EXIT_USAGE
    return 0


def write_docs(config: Path, changes: Path | None, docs: Path, *, stored: bool = False) -> None:
    """Write the pages and copy the figures; the results' folder is the configuration's.

    The pages on experiments on speeds and over a population are written where the study runs one.

    Args:
        config: The configuration.
        changes: Another that is merged over it, if any.
        docs: Folder of the documentation.
        stored: Whether to write the parts alone that are made of stored tables.

    Raises:
        ArtefactError: The study is not finished.
        ConfigError: The configuration is not valid.
        MarkError: A page's marks do not fit.
        FileNotFoundError: A page or a figure does not exist.
    """
    study = load_study(read_merged(config, changes), str(config))
    pages = stored_pages(study, docs)
    if not stored:
        pages = together(study_pages(study, docs), pages)
    texts = {page: _filled(docs / page, parts, stored) for page, parts in pages.items()}
    if not stored:
        write_figures(study, docs)
    for page, text in texts.items():
        with atomic_path(docs / page) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="\n")


def _filled(page: Path, parts: Mapping[str, str], keep: bool) -> str:
    """Return the page with its parts, others kept as they stand or refused."""
    text = page.read_text(encoding="utf-8")
    return fill(text, {**(standing(text) if keep else {}), **parts})


def write_figures(study: Study, docs: Path) -> None:
    """Copy the figures that the documentation shows from the study's results, and draw its own.

    Raises:
        FileNotFoundError: A figure does not exist.
    """
    folder, figures = Path(study.config.results), documented(PagePart.STUDY)
    if name := experiment_shown(study):
        figures += [*documented(PagePart.SPEEDS, name), f"training-{name}"]
        write_noise_figure(folder / "cohort" / "noise.h5", docs, study.config.cohort_title)
    for name in study.config.populations_run[:1]:
        figures += documented(PagePart.POPULATION, name)
        figures += [f"pressures-{name}"] if study.with_pressures(name) else []
        write_population_figure(study, name, docs)
    for figure in figures:
        with atomic_path(docs / "figures" / f"{figure}.png") as temporary:
            shutil.copyfile(folder / "figures" / f"{figure}.png", temporary)


def documented(part: PagePart, experiment: str = "") -> list[str]:
    """Return the names of the files of figures that the documentation copies from a part of the page."""
    return [spec.stem(experiment) for spec in figures_of(part).values() if spec.documented]


if __name__ == "__main__":
    sys.exit(main())
