"""Copy the tables and figures that README and docs/ name from a finished study, and fill the pages' tables.

They go into docs/tables and docs/figures.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from swesbi.artefacts import ArtefactError, atomic_path
from swesbi.config.read import ConfigError, at_configuration, read_merged
from swesbi.config.study import Study, load_study
from swesbi.study.parsers import add_options
from tools.docs.directives import PageError, filled
from tools.docs.shown import figures_of, gather, gather_again, page_texts, store, stored_in, write_figures

EXIT_USAGE: Final = 2


def main(arguments: Sequence[str]) -> int:
    """Write tables and figures of the pages; return 0, or 2 with a message."""
    parser = argparse.ArgumentParser(prog="python -m tools.docs", description=__doc__)
    add_options(parser)
    parser.add_argument(
        "--folder", type=Path, default=Path(), help="of README.md and docs/; default: this one"
    )
    parser.add_argument(
        "--stored", action="store_true", help="fill pages from stored tables; no study is needed"
    )
    try:
        given = at_configuration(parser.parse_args(arguments))
        study = None
        if not given.stored:
            study = load_study(read_merged(given.config, given.overlay), str(given.config))
        write_docs(study, given.folder)
    except (ArtefactError, ConfigError, PageError) as error:
        print(f"swesbi: {error}", file=sys.stderr)
        return EXIT_USAGE
    return 0


def write_docs(study: Study | None, folder: Path) -> None:
    """Fill README and docs/, from a finished study or, without one, from stored tables; or write nothing."""
    texts = page_texts(folder)
    with TemporaryDirectory() as name:
        stage = Path(name)
        if study:
            gather(study, folder, stage)
        else:
            gather_again(folder, stage)
        place = stored_in(folder, stage)
        pages = {page: filled(page, text, place) for page, text in texts.items()}
        if study:
            write_figures(study, figures_of(study, folder), folder)
        store(stage, folder, of_study=study is not None)
    for page, text in pages.items():
        if text != texts[page]:
            with atomic_path(folder / page) as temporary:
                temporary.write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
