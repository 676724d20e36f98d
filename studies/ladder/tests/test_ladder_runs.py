"""The ladder in its small sizes, on a finished small study."""

import pandas as pd
import pytest
from ladder_case import LADDER
from study_copy import StudyCopy, run_side_study


@pytest.mark.slow(minutes=1.0)
def test_the_small_ladder_runs_on_the_small_study(own_study: StudyCopy) -> None:
    found = run_side_study(own_study, "ladder")
    table = pd.read_csv(found / "ladder.csv")
    assert set(LADDER.structures) <= set(table["structure"])
    assert table["median"].notna().all()
    assert (found / "ladder.png").stat().st_size > 10_000
