"""The ladder in its small sizes, on a finished small study."""

import pandas as pd
import pytest
from study_copy import StudyCopy, run_side_study

from studies.ladder.table import AVERAGE


@pytest.mark.slow(minutes=0.6)
def test_the_small_ladder_runs_on_the_small_study(own_study: StudyCopy) -> None:
    found = run_side_study(own_study, "ladder")
    table = pd.read_csv(found / "ladder.csv")
    assert set(table["structure"]) == {"base", "series_spring", "alpha_4", AVERAGE}
    assert table["median"].notna().all()
    assert (found / "ladder.png").stat().st_size > 10_000
