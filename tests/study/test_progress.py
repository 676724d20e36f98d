from __future__ import annotations

import logging
from types import SimpleNamespace

import pytest

from swesbi.base import progress


def test_the_first_step_says_nothing_of_the_others(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """A minute for the first of 101 steps, which compiles, and a second for each of the others."""
    now = iter([60.0, *[60.0 + step for step in range(1, 101)]])
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: next(now)))
    caplog.set_level(logging.INFO, logger="swesbi")
    counted = progress.Progress("hearts", 101, unit="heart", _start=0.0, _last=0.0)
    for _ in range(101):
        counted.step()
    assert caplog.messages[0] == "hearts: heart 1/101 (60 s)"
    assert caplog.messages[1] == "hearts: heart 6/101 (65 s, about 95 s left)"
    assert caplog.messages[-1] == "hearts: heart 101/101 (160 s)"
