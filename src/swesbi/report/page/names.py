"""The pages by the names of their files without suffix, which the workflow names too."""

from __future__ import annotations

from typing import Final

LANDING: Final = "index"
FURTHER: Final = ("method", "checks", "paper", "files")
"""The pages in the folder ``report`` beside the landing page."""
