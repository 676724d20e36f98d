"""Numbers in a Markdown text: where a quotation with holes stands, and which numbers nothing accounts for."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from tools.claims.manifest import HOLE
from tools.docs.directives import PART, line_of

WORDS: Final = {
    "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7, "eight": 8, "nine": 9, "ten": 10,
    "eleven": 11, "twelve": 12, "sixteen": 16, "twenty": 20, "thirty": 30, "forty": 40, "fifty": 50,
    "sixty": 60, "a hundred": 100,
}  # fmt: skip
"""Numbers in words. One is not among them: it is more often an article."""
DIGITS: Final = r"[−-]?\d+(?:,\d{3})*(?:\.\d+)?"
SPELT: Final = "|".join(WORDS)
NUMBER: Final = re.compile(rf"(?<![\w.-])(?:{DIGITS}|(?:{SPELT})\b)", re.IGNORECASE)
SHARE: Final = re.compile(rf"(?P<shares>{DIGITS}(?:(?:, | to | and |, and ){DIGITS})*) ?%(?P<behind>\s+\w+)?")
"""Numbers in per cent, and the word behind them."""
LEVELS: Final = ("interval", "intervals", "band", "bands", "probability", "credible")
"""Behind which a share is the level of an interval."""
IN_HOLE: Final = rf"(?<![\d.])({DIGITS}|(?i:{SPELT}))(?![\d])"
UNREAD: Final = (
    PART,  # written by `make docs`, and compared as a whole
    re.compile(r"<!--.*?-->", re.DOTALL),
    re.compile(r"^```.*?^```", re.DOTALL | re.MULTILINE),
    re.compile(r"`[^`]*`"),
    re.compile(r"\]\([^)]*\)"),
    re.compile(r"^ *\d+\. ", re.MULTILINE),
)
"""What of a text claims nothing: filled tables, comments, code, targets of links, numbers of items."""


@dataclass(frozen=True)
class Quotation:
    """Where a quotation stands in a text, from ``start`` to before ``end``, and what its holes print."""

    start: int
    end: int
    numbers: tuple[str, ...]


def quotations(quoted: str, text: str) -> list[Quotation]:
    """Return every place in a text where a quotation stands; any white space stands for any other."""
    pieces = [r"\s+".join(map(re.escape, re.split(r"\s+", piece))) for piece in quoted.split(HOLE)]
    pattern = re.compile(IN_HOLE.join(pieces))
    return [Quotation(match.start(), match.end(), match.groups()) for match in pattern.finditer(text)]


def value_of(printed: str) -> float:
    """Return a printed number: "−0.84", "1,000" or "fifty"."""
    word = WORDS.get(printed.lower())
    return float(printed.replace(",", "").replace("−", "-")) if word is None else float(word)


def rounding(printed: str) -> float:
    """Return by how much the value behind a printed number may differ from it: half of its last digit."""
    decimals = len(printed.partition(".")[2])
    return 0.5 * 10.0**-decimals * (1.0 + 1e-9)


def unaccounted(
    text: str, accounted: Sequence[Quotation], *, shares_only: bool = False
) -> Iterator[tuple[int, str]]:
    """Yield line and surroundings of each number of a Markdown text that lies in no quotation.

    Levels of intervals are left out; with ``shares_only`` everything but numbers in per cent is.
    """
    read = _read(text, UNREAD)
    found = list(SHARE.finditer(read))
    shares = [match.span("shares") for match in found]
    levels = [match.span("shares") for match in found if _is_level(match["behind"])]
    left_out = [*levels, *((place.start, place.end) for place in accounted)]
    for match in NUMBER.finditer(read):
        if _within(match.start(), left_out) or (shares_only and not _within(match.start(), shares)):
            continue
        around = text[max(match.start() - 30, 0) : match.end() + 30]
        yield line_of(text, match.start()), " ".join(around.split())


def _within(at: int, spans: Iterable[tuple[int, int]]) -> bool:
    return any(start <= at < end for start, end in spans)


def _is_level(behind: str | None) -> bool:
    return (behind or "").strip() in LEVELS


def _read(text: str, unread: Iterable[re.Pattern[str]]) -> str:
    """Return a text of the same length with blanks where patterns match."""
    for pattern in unread:
        text = pattern.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
    return text
