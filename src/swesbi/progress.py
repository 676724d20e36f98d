"""Progress of long work as log lines: what is being done, how far, how long still."""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass, field

LOGGER = logging.getLogger("swesbi")


@dataclass
class Progress:
    """Counts steps of long work and logs a line at most every ``every_s`` seconds, and at the end.

    Example: ``progress = Progress("cmaes A", total=10, unit="run")``, then ``progress.step()`` after each.
    """

    label: str
    total: int
    unit: str = "step"
    every_s: float = 5.0
    done: int = 0
    _start: float = field(default_factory=time.monotonic)
    _last: float = field(default_factory=time.monotonic)

    def step(self, count: int = 1, note: str = "") -> None:
        """Count ``count`` finished steps; ``note`` is appended to the line (a loss, say)."""
        self.done += count
        now = time.monotonic()
        if self.done >= self.total or now - self._last >= self.every_s:
            self._last = now
            LOGGER.info("%s", self._line(now - self._start, note))

    def _line(self, elapsed_s: float, note: str) -> str:
        left_s = elapsed_s * (self.total - self.done) / max(self.done, 1)
        timing = (
            f"{elapsed_s:.0f} s"
            if self.done >= self.total
            else f"{elapsed_s:.0f} s, at most {left_s:.0f} s left"
        )
        return f"{self.label}: {self.unit} {self.done}/{self.total} ({timing}){' ' + note if note else ''}"
