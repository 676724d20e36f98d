"""The part of the page on other people's hearts: the last whole sitting of the shipped study's validation."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from swesbi.report.table import Table
from swesbi.report.tables.validation import validation_table
from swesbi.report.tables.validation_outcomes import in_brief
from swesbi.report.tables.validation_sittings import compared_width, last_whole, read_sittings


@dataclass(frozen=True)
class StoredValidation:
    """The validation of the shipped study: what came out in sentences, and all of it."""

    brief: tuple[str, ...]
    table: Table


def stored_validation(path: Path) -> StoredValidation:
    """Return what the page shows of the validation.

    Args:
        path: The stored table of all sittings.

    Raises:
        ArtefactError: It is no such table, or no sitting of it is whole.
    """
    sittings = read_sittings(path)
    shown = last_whole(sittings)
    caption = f"The validation of the shipped study: sitting {shown.number}, {shown.date}; {shown.model}."
    brief = in_brief(shown.rows, compared_width(sittings, shown))
    return StoredValidation(brief, validation_table(shown.rows, caption))
