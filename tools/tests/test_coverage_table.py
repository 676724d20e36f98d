"""The table of coverage has every stored number where it belongs."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from tools.docs.coverage import coverage_table

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    return coverage_table(ROOT)


def test_the_stored_table_is_of_the_stored_tables(table: pd.DataFrame) -> None:
    """If it fails: make docs."""
    pd.testing.assert_frame_equal(
        pd.read_csv(ROOT / "docs/tables/coverage.csv"), table, rtol=1e-6, check_dtype=False
    )


def test_coverage_is_that_of_the_stored_tables(table: pd.DataFrame) -> None:
    stored = pd.read_csv(ROOT / "docs" / "tables" / "amortised_recovery.csv")
    row = stored[(stored["nominal"] == 0.9) & (stored["parameter"] == "k0_kpa")].iloc[0]
    assert table.loc[0, ["k0_kpa", "n"]].tolist() == row[["coverage", "n"]].tolist()


def test_a_generator_with_too_few_hearts_has_no_coverage_of_those_not_contradicted(
    table: pd.DataFrame,
) -> None:
    few = table["n_not_contradicted"] < 30
    assert few.any()
    assert table.loc[few, "k_sr_per_s"].isna().all()
    assert table.loc[few, "all_peak_active_kpa"].notna().all()
