"""Names that decide which hearts are drawn: of a random stream, of generators."""

from __future__ import annotations

from typing import Final

VALIDATION_STREAM: Final = "exam"
"""Name of the random streams of the hearts of the validation; another name gives other hearts."""
DEVELOPMENT: Final = ("u", "v", "w", "x", "y", "z")
"""Letters of the structures that are in no validation."""
