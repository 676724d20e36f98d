"""What pages show: the tables and figures that they name, taken from a finished study."""

from __future__ import annotations

import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from swesbi.artefacts import atomic_path
from swesbi.artefacts.csv import write_csv
from swesbi.config.study import Study
from swesbi.report.figures.style import save_figure
from tools.docs.directives import PageError, Place, line_of
from tools.docs.figures import DRAWN
from tools.docs.made import MADE, OF_STORED
from tools.model_version import STORED, note_versions

CLAIMS: Final = "docs/claims.yaml"
STUDY: Final = "study"
"""Folder of the study's tables among the stored ones."""
OF_STUDY: Final = re.compile(rf"(?<![\w/])(?:docs/)?tables/{STUDY}/(?P<name>[\w./-]+)\.csv")
OF_ENGINE: Final = re.compile(rf"(?<![\w/])(?:docs/)?tables/(?P<name>{'|'.join([*MADE, *OF_STORED])})\.csv")
FIGURE: Final = re.compile(r"(?<![\w/])(?:docs/)?figures/(?P<name>[\w-]+)\.png")


def page_texts(folder: Path) -> dict[str, str]:
    """Return README and the pages of docs/ by their paths within the project's folder."""
    paths = [folder / "README.md", *sorted((folder / "docs").glob("*.md"))]
    return {path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8") for path in paths}


def stored_in(folder: Path, stage: Path | None = None) -> Place:
    """Return where files lie in the project's folder; tables of docs/ that were gathered, in the stage."""

    def place(path: str) -> Path:
        staged = stage / Path(path).relative_to(STORED) if stage and path.startswith(f"{STORED}/") else None
        return staged if staged and staged.is_file() else folder / path

    return place


class UnfinishedError(PageError):
    """The study has not made a table that a page names; the message says which and where."""


def gather(study: Study, folder: Path, stage: Path) -> None:
    """Put the tables that pages and claims name, and a study gives, into a folder laid out as docs/tables."""
    texts = page_texts(folder)
    if (folder / CLAIMS).is_file():
        texts[CLAIMS] = (folder / CLAIMS).read_text(encoding="utf-8")
    for name, where in _named(OF_STUDY, texts).items():
        source = Path(study.config.results) / f"{name}.csv"
        if not source.is_file():
            raise UnfinishedError(f"{where}: {source} does not exist: finish the study first (make study)")
        target = stage / STUDY / f"{name}.csv"
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, target)
    for name in set(MADE) & set(_named(OF_ENGINE, texts)):
        write_csv(stage / f"{name}.csv", MADE[name](study))
    gather_again(folder, stage)


def gather_again(folder: Path, stage: Path) -> None:
    """Put the tables that stored ones give into that folder, where pages name them."""
    for name in set(OF_STORED) & set(_named(OF_ENGINE, page_texts(folder))):
        write_csv(stage / f"{name}.csv", OF_STORED[name]())


def store(stage: Path, folder: Path, *, of_study: bool) -> None:
    """Move gathered tables to docs/tables, with the model's version; tables of a study that none names go."""
    tables = folder / STORED
    gathered = {path.relative_to(stage): path for path in sorted(stage.rglob("*.csv"))}
    for old in (tables / STUDY).rglob("*.csv") if of_study else ():
        if old.relative_to(tables) not in gathered:
            old.unlink()
    for name, source in gathered.items():
        with atomic_path(tables / name) as temporary:
            shutil.copyfile(source, temporary)
    note_versions(tables, [name.with_suffix("").as_posix() for name in gathered])


def figures_of(study: Study, folder: Path) -> dict[str, Path]:
    """Return the figures that pages name and the study gives: those drawn here, and copies with a source."""
    found = {}
    for name, where in _named(FIGURE, page_texts(folder)).items():
        source = Path(study.config.results) / "figures" / f"{name}.png"
        if source.is_file() or name in DRAWN:
            found[name] = source
        elif not (folder / "docs" / "figures" / source.name).is_file():
            raise PageError(f"{where}: neither {source} nor docs/figures/{source.name} exists")
    return found


def write_figures(study: Study, figures: Mapping[str, Path], folder: Path) -> None:
    """Draw and copy figures into docs/figures."""
    for name, source in figures.items():
        target = folder / "docs" / "figures" / f"{name}.png"
        if name in DRAWN:
            save_figure(DRAWN[name](study), target)
            continue
        with atomic_path(target) as temporary:
            shutil.copyfile(source, temporary)


def _named(pattern: re.Pattern[str], texts: Mapping[str, str]) -> dict[str, str]:
    """Return names that texts have, each with page and line of the first place."""
    found: dict[str, str] = {}
    for page, text in texts.items():
        for match in pattern.finditer(text):
            found.setdefault(match["name"], f"{page}:{line_of(text, match.start())}")
    return found
