"""The variants in their small sizes, on a finished small study."""

import pandas as pd
import pytest
from study_copy import StudyCopy, run_side_study


@pytest.mark.slow(minutes=0.6)
def test_the_small_sensitivity_runs_on_the_small_study(own_study: StudyCopy) -> None:
    found = run_side_study(own_study, "sensitivity")
    table = pd.read_csv(found / "sensitivity.csv")
    assert set(table["variant"]) == {"base", "fixed_physiology", "fixed_scale"}
    assert table["median"].notna().all()
    assert (found / "sensitivity.png").stat().st_size > 10_000
