"""Which functions of the package a stage runs."""

from __future__ import annotations

import functools
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any

import swesbi

SOURCE = Path(swesbi.__file__).parent


@dataclass
class Trace:
    """Functions that ran, as module and first line; not what runs because a module is imported.

    Functions that numba compiles are seen where ``NUMBA_DISABLE_JIT`` is set.
    """

    ran: set[tuple[str, int]] = field(default_factory=set)
    _imports: int = 0

    def of(self, run: Callable[..., Any]) -> Callable[..., Any]:
        """Return a stage's function that notes what it runs, in this thread and in those that it starts."""

        @functools.wraps(run)
        def traced(*artefacts: object, **settings: object) -> object:
            before = sys.getprofile()
            sys.setprofile(self._note)
            threading.setprofile(self._note)
            try:
                return run(*artefacts, **settings)
            finally:
                sys.setprofile(before)
                threading.setprofile(before)

        return traced

    def _note(self, frame: FrameType, event: str, _: object) -> None:
        code = frame.f_code
        if code.co_name == "<module>":
            self._imports += {"call": 1, "return": -1}.get(event, 0)
        elif event == "call" and not self._imports and code.co_filename.startswith(str(SOURCE)):
            parts = Path(code.co_filename).relative_to(SOURCE.parent).with_suffix("").parts
            self.ran.add((".".join(parts).removesuffix(".__init__"), code.co_firstlineno))
