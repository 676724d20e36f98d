"""What tables of checks call recordings, answers and alarms, wherever they are shown."""

from __future__ import annotations

from typing import Final

RECORDINGS: Final = {
    "own": "the model's own noise",
    "acquired": "acquired sample by sample",
    "local": "at the subject's own data",
    "volunteer": "the volunteer recorded anew",
}
ANSWERS: Final = {"npe": "network alone", "weighted": "exact weights"}
POOLED: Final = "pooled"
"""In place of a subject: the recordings of all."""
ALARMS: Final = ("strained or unsupported", "unsupported")
