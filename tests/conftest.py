"""What many modules share: a finished small study, and the order in which tests run."""

from __future__ import annotations

import pytest
from small_study import editable, finished, own_study

__all__ = ["editable", "finished", "own_study"]


@pytest.hookimpl(tryfirst=True)  # before tests are deselected by their markers
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what needs a finished study as slow, and begin with what takes longest.

    A worker is then not left with a long test when the others have finished.
    """
    for item in items:
        if needs_study(item) and not any(map(item.get_closest_marker, ("slow", "exhaustive"))):
            item.add_marker(pytest.mark.slow(minutes=0.1))
    items.sort(key=minutes, reverse=True)


def needs_study(item: pytest.Item) -> bool:
    """Return whether a test takes a finished small study, or a copy of one."""
    return "finished" in getattr(item, "fixturenames", ())


def minutes(item: pytest.Item) -> float:
    """Return how long a test takes, roughly, as its marker says."""
    mark = item.get_closest_marker("slow") or item.get_closest_marker("exhaustive")
    return float(mark.kwargs.get("minutes", 1.0)) if mark else 0.0
