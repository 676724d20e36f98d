"""What is verified of README and documentation: claims, tables of pages, versions of stored tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Final

from tools.claims.manifest import Claim, Manifest, ValueSource
from tools.claims.prose import quotations, rounding, unaccounted, value_of
from tools.claims.sources import NoValueError, value_found
from tools.docs.directives import PART, PageError, Place, filled, line_of
from tools.model_version import MODEL_VERSION, STORED, VERSIONS, read_versions

NO_PRODUCT: Final = frozenset({"settings", "scaling", "study_cost"})
"""Stored tables that are no product of the model: settings and costs."""
PAGES: Final = ("README.md", "docs/*.md", "studies/*/README.md")
"""Where tables are named: by paths that end with tables/NAME.csv."""
REMEDY: Final = "make it again, then python -m tools.model_version --note"
"""Followed by the path; `make docs` and `make full` note versions themselves."""


@dataclass(frozen=True)
class Finding:
    """What became of one number, one table of a page, or one stored table.

    ``what`` quotes the words, or says what is asked; ``source`` is what was asked, and for what.
    """

    holds: bool
    where: str
    what: str
    expected: str = ""
    found: str = ""
    source: str = ""


def claims_judged(manifest: Manifest, place: Place) -> Iterator[Finding]:
    """Yield a finding for each number of each claim, and one for each number that nothing accounts for."""
    named = {*manifest.complete, *manifest.shares, *(each.file for each in manifest.quoted)}
    texts = {name: place(name).read_text(encoding="utf-8") for name in sorted(named)}
    for claim in manifest.claims:
        yield from _claim(claim, texts[claim.file], manifest.sources, place)
    for each in manifest.no_claims:
        if not quotations(each.text, texts[each.file]):
            yield Finding(False, each.file, each.text, found="the text is no longer there")
    for shares_only, names in ((False, manifest.complete), (True, manifest.shares)):
        for name in names:
            entries = [each.text for each in manifest.quoted if each.file == name]
            accounted = [each for text in entries for each in quotations(text, texts[name])]
            for line, around in unaccounted(texts[name], accounted, shares_only=shares_only):
                yield Finding(False, f"{name}:{line}", around, found="a number that no claim accounts for")


def _claim(claim: Claim, text: str, sources: Mapping[str, str], place: Place) -> Iterator[Finding]:
    places = quotations(claim.text, text)
    if len(places) != 1:
        wrong = f"stands there {len(places)} times: quote more" if places else "the text is no longer there"
        yield Finding(False, claim.file, claim.text, found=wrong)
        return
    where = f"{claim.file}:{line_of(text, places[0].start)}"
    for printed, found in zip(places[0].numbers, claim.found, strict=True):
        asked = _asked(sources[found.of], found)
        try:
            value = value_found(sources[found.of], found, place)
        except NoValueError as error:
            yield Finding(False, where, claim.text, printed, str(error), asked)
            continue
        holds = abs(value - value_of(printed)) <= (found.tolerance or rounding(printed))
        yield Finding(holds, where, claim.text, printed, f"{value:.6g}", asked)


def _asked(source: str, found: ValueSource) -> str:
    rows = f" where {found.where}" if found.where else ""
    by = "" if found.by == "only" else f"{found.by} of "
    return f"{source}: {by}{found.value}{rows}"


def pages_judged(texts: Mapping[str, str], place: Place) -> Iterator[Finding]:
    """Yield a finding for each table of a page, beside what `make docs` would write now."""
    for page, text in texts.items():
        try:
            now = filled(page, text, place)
        except PageError as error:
            yield Finding(False, page, "the tables of the page", found=str(error))
            continue
        for old, new in zip(PART.finditer(text), PART.finditer(now), strict=True):
            where, what = f"{page}:{line_of(text, old.start())}", f"the table of {old['path']}"
            lines = zip_longest(old["body"].splitlines(), new["body"].splitlines(), fillvalue="")
            stands, written = next(((a, b) for a, b in lines if a != b), ("", ""))
            yield Finding(old["body"] == new["body"], where, what, stands, written, "make docs")


def versions_judged(folder: Path) -> Iterator[Finding]:
    """Yield a finding for each stored table: this version's model made it, or its pages say whose did.

    Each page that names the table must. Tables of side studies are asked where versions lie beside them.
    """
    pages = [path.read_text(encoding="utf-8") for each in PAGES for path in sorted(folder.glob(each))]
    beside = sorted(folder.glob(f"studies/*/tables/{VERSIONS}"))
    for tables in (folder / STORED, *(path.parent for path in beside)):
        known = read_versions(tables)
        for path in sorted(tables.rglob("*.csv")):
            name = path.relative_to(tables).with_suffix("").as_posix()
            if path.name == VERSIONS or name in NO_PRODUCT:
                continue
            found = f"version {known[name]}" if name in known else "no version"
            naming = [page for page in pages if f"tables/{name}.csv" in page]
            said = name in known and [f"model version {known[name]}" in page for page in naming]
            holds = known.get(name) == MODEL_VERSION or bool(said and all(said))
            where, asked = path.relative_to(folder).as_posix(), f"version {MODEL_VERSION}"
            yield Finding(holds, where, "version of its model", asked, found, f"{REMEDY} {where}")
