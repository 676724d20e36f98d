"""Marked parts of pages beside what is generated now: the first number that differs, or how many agree."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import zip_longest
from os.path import commonprefix
from pathlib import Path
from typing import Final

from tools.claims.findings import FAILS, HOLDS, NOT_ASKED, Finding
from tools.claims.prose import NUMBER, line_of
from tools.docs.marks import PART
from tools.docs.pages import Pages

MAKE_DOCS: Final = "make docs"
GENERATED: Final = "what is generated now"
LONGEST: Final = 70


def parts_judged(pages: Pages, docs: Path) -> Iterator[Finding]:
    """Yield a finding for each marked part: all its text is claimed.

    A part that nothing is given for is not asked: it is made of a finished study.
    """
    for path in sorted(docs.glob("*.md")):
        text = path.read_text(encoding="utf-8")
        for match in PART.finditer(text):
            now = pages.get(path.name, {}).get(match["name"])
            yield _compared(f"{path}:{line_of(text, match.start())}", match["name"], match["body"], now)


def _compared(where: str, name: str, stands: str, now: str | None) -> Finding:
    told = {"claim": f"part {name!r}", "source": GENERATED, "made_by": MAKE_DOCS}
    if now is None:
        return Finding(NOT_ASKED, where, **told)
    pairs = zip_longest(stands.strip().splitlines(), now.strip().splitlines(), fillvalue="")
    differing = next(((old, new) for old, new in pairs if old != new), None)
    if differing is None:
        count = f"{len(NUMBER.findall(stands))} numbers"
        return Finding(HOLDS, where, expected=count, found=count, **told)
    old, new = _apart(*differing)
    return Finding(FAILS, where, expected=old, found=new, **told)


def _apart(old: str, new: str) -> tuple[str, str]:
    """Return two lines from a little before the character in which they begin to differ."""
    start = max(len(commonprefix((old, new))) - LONGEST // 2, 0)
    return old[start : start + LONGEST], new[start : start + LONGEST]
