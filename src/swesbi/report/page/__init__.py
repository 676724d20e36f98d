"""The pages of the results: what was done, what came out, and where every file lies."""

from typing import Final

FURTHER: Final = ("method", "checks", "paper", "files")
"""The pages in the folder ``report`` beside the landing page, which the workflow names too."""
