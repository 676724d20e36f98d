"""Value types that several settings models share."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field


def _check_window(window: tuple[float, float]) -> tuple[float, float]:
    start, end = window
    if not 0.0 <= start < end <= 1.0:
        raise ValueError(f"a window of the cycle needs 0 <= start < end <= 1, got [{start}, {end}]")
    return window


CycleWindow = Annotated[
    tuple[float, float],
    AfterValidator(_check_window),
    Field(description="Start and end of a part of the cardiac cycle, as fractions of it from the R peak."),
]
