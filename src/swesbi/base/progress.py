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
    Work of ``at_most`` so many steps may end earlier, so nothing is said of the time that is left.
    """

    label: str
    total: int
    unit: str = "step"
    every_s: float = 5.0
    at_most: bool = False
    done: int = 0
    _start: float = field(default_factory=time.monotonic)
    _last: float = field(default_factory=time.monotonic)
    _first: tuple[int, float] | None = None

    def step(self, count: int = 1, note: str = "") -> None:
        """Count ``count`` finished steps; ``note`` is appended to the line (a loss, say)."""
        self.done += count
        now = time.monotonic()
        # the first step has compiled and read what all need, and says nothing of the others
        self._first = self._first or (self.done, now)
        if self.done >= self.total or now - self._last >= self.every_s:
            self._last = now
            LOGGER.info("%s", self._line(now, *self._first, note))

    def _line(self, now: float, first: int, first_at: float, note: str) -> str:
        timing = f"{now - self._start:.0f} s"
        if first < self.done < self.total and not self.at_most:
            left_s = (now - first_at) * (self.total - self.done) / (self.done - first)
            timing += f", about {left_s:.0f} s left"
        return f"{self.label}: {self.unit} {self.done}/{self.total} ({timing}){' ' + note if note else ''}"
