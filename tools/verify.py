"""Hold what README and documentation say in numbers against tables, settings and code.

Every number that README, pages of results and side studies claim is found in the table, setting or constant
that gives it (docs/claims.yaml, studies/*/claims.yaml). So is every number in per cent on other pages. The
tables of all pages are written anew and compared, and the version of every stored table with the model's. The
exit code is 1 where anything fails. Where no study is finished, tables are those stored in docs/tables. Run
it in the project's folder.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from swesbi.artefacts import ArtefactError
from swesbi.config.read import ConfigError, at_configuration, read_merged
from swesbi.config.study import Study, load_study
from swesbi.study.parsers import add_options
from tools.claims.findings import Finding, claims_judged, pages_judged, versions_judged
from tools.claims.manifest import read_manifest
from tools.docs.directives import PageError
from tools.docs.shown import CLAIMS, UnfinishedError, gather, page_texts, stored_in

EXIT_FAILED: Final = 1
EXIT_USAGE: Final = 2


def main(arguments: Sequence[str]) -> int:
    """Run `verify`; return 0 where all is as it should be, 1 where something fails, 2 with a message.

    Every failure is printed with its place, what stands there and what was found.
    """
    parser = argparse.ArgumentParser(prog="python -m tools.verify", description=__doc__)
    add_options(parser)
    unfinished = ""
    try:
        given = at_configuration(parser.parse_args(arguments))
        study = load_study(read_merged(given.config, given.overlay), str(given.config))
        try:
            findings = verified(study, Path())
        except UnfinishedError as error:
            findings, unfinished = verified(None, Path()), str(error)
    except (ArtefactError, ConfigError, PageError) as error:
        print(f"verify: {error}", file=sys.stderr)
        return EXIT_USAGE
    failed = [each for each in findings if not each.holds]
    for each in failed:
        print(f"{each.where}: {each.what}\n  expected: {each.expected}")
        print(f"  found: {each.found} [{each.source}]")
    print(f"{len(findings) - len(failed)} hold, {len(failed)} fail")
    if unfinished:
        print(f"no finished study, so only what is stored was compared ({unfinished})")
    return EXIT_FAILED if failed else 0


def verified(study: Study | None, folder: Path) -> list[Finding]:
    """Return a finding for each claimed number, each table of a page and each stored table.

    The tables of pages are made of the study's results; without a study, stored tables are asked.
    """
    with TemporaryDirectory() as name:
        stage = Path(name)
        if study:
            gather(study, folder, stage)
        place = stored_in(folder, stage)
        manifests = map(read_manifest, [folder / CLAIMS, *sorted(folder.glob("studies/*/claims.yaml"))])
        claims = [finding for manifest in manifests for finding in claims_judged(manifest, place)]
        return [*claims, *pages_judged(page_texts(folder), place), *versions_judged(folder)]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
