"""Groups of samples against pandas, which groups by the same keys."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from swesbi.recording.samples import grouped


@pytest.mark.parametrize("keys", [["phase"], ["phase", "repeat"]])
def test_groups_are_those_of_pandas(keys: list[str]) -> None:
    rng = np.random.default_rng(3)
    table = pd.DataFrame(
        {"phase": rng.integers(3, 9, 200), "repeat": rng.integers(0, 4, 200), "value": rng.normal(size=200)}
    )
    groups = grouped(*(table[name].to_numpy() for name in keys))
    own = table.groupby(keys)["value"]
    value = table["value"].to_numpy()
    np.testing.assert_array_equal(groups.sizes, own.size())
    np.testing.assert_array_equal(table[keys].to_numpy()[groups.first], own.size().reset_index()[keys])
    for found, expected in (
        (groups.sums(value), own.sum()),
        (groups.means(value), own.mean()),
        (groups.medians(value), own.median()),
        (groups.scatter(value), own.var() * (own.size() - 1)),
    ):
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-14)


def test_of_nothing_there_are_no_groups() -> None:
    groups = grouped(np.zeros(0, np.int64), np.zeros(0, np.int64))
    assert groups.sizes.size == groups.means(np.zeros(0)).size == groups.medians(np.zeros(0)).size == 0
