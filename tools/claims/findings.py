"""What became of each claim: expected, found, and whether both agree."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from tools.claims.manifest import Claim, CodeSource, Found, Manifest, Source
from tools.claims.prose import Quotation, line_of, quotations, rounding, unaccounted, value_of
from tools.claims.sources import NoValueError, Sources

HOLDS: Final = "holds"
FAILS: Final = "FAILS"
NOT_ASKED: Final = "not asked"
COLUMNS: Final = ("outcome", "where", "claim", "expected", "found", "tolerance", "source", "made_by")


@dataclass(frozen=True)
class Finding:
    """What became of one number.

    Attributes:
        outcome: One of ``HOLDS``, ``FAILS``, ``NOT_ASKED``.
        where: File, and line where the words stand.
        claim: The words.
        expected: The number as printed.
        found: The value that the source gives, or why it gives none.
        tolerance: By how much both may differ.
        source: The file, module or generator that was asked.
        made_by: The command behind it.
    """

    outcome: str
    where: str
    claim: str
    expected: str = ""
    found: str = ""
    tolerance: str = ""
    source: str = ""
    made_by: str = ""


def judged(manifest: Manifest, sources: Sources) -> Iterator[Finding]:
    """Yield a finding for each number of each claim, and one for each number that nothing accounts for."""
    named = {*manifest.complete, *(each.file for each in manifest.quoted)}
    texts = {name: Path(name).read_text(encoding="utf-8") for name in sorted(named)}
    for claim in manifest.claims:
        yield from _judged(claim, texts[claim.file], sources)
    for each in manifest.no_claims:
        if not quotations(each.text, texts[each.file]):
            yield Finding(FAILS, each.file, each.text, found="the text is no longer there")
    for name in manifest.complete:
        for line, around in unaccounted(texts[name], _accounted(name, manifest, texts)):
            yield Finding(FAILS, f"{name}:{line}", around, found="a number that no claim accounts for")


def _accounted(name: str, manifest: Manifest, texts: Mapping[str, str]) -> list[Quotation]:
    entries = (each for each in manifest.quoted if each.file == name)
    return [place for each in entries for place in quotations(each.text, texts[name])]


def _judged(claim: Claim, text: str, sources: Sources) -> Iterator[Finding]:
    places = quotations(claim.text, text)
    if len(places) != 1:
        said = f"stands there {len(places)} times: quote more" if places else "the text is no longer there"
        yield Finding(FAILS, claim.file, claim.text, found=said)
        return
    (place,) = places
    where = f"{claim.file}:{line_of(text, place.start)}"
    for printed, found in zip(place.numbers, claim.found, strict=True):
        yield _number(where, claim.text, printed, found, sources)


def _number(where: str, text: str, printed: str, found: Found, sources: Sources) -> Finding:
    source, tolerance = sources.named[found.of], found.tolerance or rounding(printed)
    told = {"tolerance": f"{tolerance:.3g}", "source": _asked(source, found), "made_by": source.made_by}
    if not sources.asked(found):
        return Finding(NOT_ASKED, where, text, printed, **told)
    try:
        value = sources.value(found)
    except NoValueError as error:
        return Finding(FAILS, where, text, printed, str(error), **told)
    outcome = HOLDS if abs(value - value_of(printed)) <= tolerance else FAILS
    return Finding(outcome, where, text, printed, f"{value:.6g}", **told)


def _asked(source: Source, found: Found) -> str:
    place = source.module if isinstance(source, CodeSource) else source.path
    rows = f" where {found.where}" if found.where else ""
    by = "" if found.by == "only" else f"{found.by} of "
    return f"{place}: {by}{found.value}{rows}"


def table_of(findings: Sequence[Finding]) -> pd.DataFrame:
    """Return findings as a table, a row a number, those that fail first."""
    rows = [[getattr(each, name) for name in COLUMNS] for each in findings]
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    order = np.argsort(table["outcome"].ne(FAILS).to_numpy(), kind="stable")
    return table.iloc[order].reset_index(drop=True)
