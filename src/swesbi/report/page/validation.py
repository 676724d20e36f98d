"""The part of the page on other people's hearts: the stored validation of the shipped study."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from swesbi.report.table import Table
from swesbi.report.tables.validation import read_validation, validation_table
from swesbi.report.tables.validation_outcomes import in_brief

CAPTION: Final = "The validation of the shipped study."


@dataclass(frozen=True)
class StoredValidation:
    """The validation of the shipped study: what came out in sentences, and all of it."""

    brief: tuple[str, ...]
    table: Table


def stored_validation(path: Path) -> StoredValidation:
    """Return what the page shows of the validation.

    Args:
        path: Its stored table.

    Raises:
        ArtefactError: It is no such table.
    """
    table = read_validation(path)
    return StoredValidation(in_brief(table), validation_table(table, CAPTION))
