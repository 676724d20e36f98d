"""Marked parts of a Markdown page: what stands between marks is written from results, the rest by people."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

PART: Final = re.compile(
    r"(?P<begin><!-- begin (?P<name>[a-z_]+)[^\n]*-->\n)(?P<body>.*?)(?P<end><!-- end (?P=name) -->)",
    re.DOTALL,
)
MARK: Final = re.compile(r"<!-- (?:begin|end) ([a-z_]+)")


class MarkError(ValueError):
    """A page whose marks do not fit; the message says which."""


def standing(page: str) -> dict[str, str]:
    """Return what stands on the page, by mark."""
    return {match["name"]: match["body"] for match in PART.finditer(page)}


def fill(page: str, parts: Mapping[str, str]) -> str:
    """Return the page with every marked part replaced; text outside the marks stays as it is.

    Raises:
        MarkError: A mark is unknown, or has no partner.
    """
    names = [match["name"] for match in PART.finditer(page)]
    if unpaired := [name for name in MARK.findall(PART.sub("", page))]:
        raise MarkError(f"the mark {unpaired[0]!r} has no partner: write <!-- begin x --> ... <!-- end x -->")
    if unknown := [name for name in names if name not in parts]:
        raise MarkError(f"no part is called {unknown[0]!r}; there are {', '.join(parts)}")
    return PART.sub(lambda match: f"{match['begin']}\n{parts[match['name']].strip()}\n\n{match['end']}", page)
