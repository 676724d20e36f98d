"""Hold what README and documentation claim in numbers against tables, settings and code."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final, get_args

import pandas as pd

from swesbi.artefacts import ArtefactError
from swesbi.config.read import ConfigError, add_options, parsed, read_merged
from swesbi.config.study import load_study
from swesbi.report.csv import write_csv
from tools.claims.findings import FAILS, HOLDS, NOT_ASKED, Finding, judged, table_of
from tools.claims.manifest import Study, read_manifest
from tools.claims.parts import parts_judged
from tools.claims.sources import Sources
from tools.docs.pages import stored_pages, study_pages, together

DOCS: Final = Path("docs")
EXIT_FAILED: Final = 1
EXIT_USAGE: Final = 2
WIDTHS: Final = {"outcome": 9, "where": 26, "claim": 58, "expected": 12, "found": 14, "made_by": 40}
"""Columns of the printed table and how wide they are; the CSV has all columns at full length."""


def main(arguments: Sequence[str]) -> int:
    """Run `verify`; return 0 where every claim that is asked holds, 1 where one fails.

    Raises:
        ConfigError: The configuration is wrong.
        ArtefactError: The manifest is wrong, or the study that is asked is not finished.
    """
    options = parsed(_parser(), arguments)
    findings = verified(options.config, options.overlay, options.study, options.manifest)
    table = table_of(findings)
    if options.out:
        write_csv(options.out, table)
    print(_listing(table))
    counts = ", ".join(f"{(table['outcome'] == name).sum()} {name}" for name in (HOLDS, FAILS, NOT_ASKED))
    print(f"\n{counts}{f'; all of it: {options.out}' if options.out else ''}")
    return EXIT_FAILED if table["outcome"].eq(FAILS).any() else 0


def verified(config: Path, changes: Path | None, whose: Study, manifest: Path) -> list[Finding]:
    """Return a finding for each number that the manifest claims and each marked part of a page.

    Args:
        config: The configuration's file.
        changes: Configuration merged over it, if any.
        whose: Whose results are asked.
        manifest: The manifest's file.

    Raises:
        ConfigError: The configuration is wrong.
        ArtefactError: The manifest is wrong, or the study that is asked is not finished.
    """
    study = load_study(read_merged(config, changes), str(config))
    claims = read_manifest(manifest)
    pages = stored_pages(study, DOCS)
    if whose == "full":
        pages = together(study_pages(study, DOCS), pages)
    sources = Sources(claims.sources, Path(study.config.results), whose)
    return [*judged(claims, sources), *parts_judged(pages, DOCS)]


def _listing(table: pd.DataFrame) -> str:
    """Return the table as lines of text, what is too long cut short."""
    rows = [tuple(WIDTHS), *table[list(WIDTHS)].itertuples(index=False)]
    lines = [map(_cell, map(str, row), WIDTHS.values()) for row in rows]
    return "\n".join("  ".join(cells).rstrip() for cells in lines)


def _cell(text: str, width: int) -> str:
    flat = " ".join(text.split())
    return (flat if len(flat) <= width else f"{flat[: width - 1]}…").ljust(width)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m tools.verify",
        description="Find every number that README and documentation claim, in the table, setting or "
        "constant that gives it, as the manifest says (docs/claims.yaml). A number that rounds otherwise, "
        "words that are no longer there, a number of the README that no claim accounts for and a marked part "
        "of a page that would be generated otherwise make the exit code 1. Run it in the project's folder.",
    )
    parser.add_argument(
        "--study",
        choices=get_args(Study),
        default="full",
        help="whose results are asked. full: the finished study that the documentation shows; small: the "
        "smoke study, for claims that hold there; none: no results, what the repository holds. Default: full",
    )
    parser.add_argument(
        "--manifest", type=Path, default=DOCS / "claims.yaml", help="default: docs/claims.yaml"
    )
    parser.add_argument("--out", type=Path, help="write the whole table as CSV, too")
    add_options(parser)
    return parser


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except (ArtefactError, ConfigError) as error:
        print(f"verify: {error}", file=sys.stderr)
        sys.exit(EXIT_USAGE)
