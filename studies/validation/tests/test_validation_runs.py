"""The validation in its small sizes, on a finished small study."""

import pandas as pd
import pytest
from study_copy import StudyCopy, run_side_study


@pytest.mark.slow(minutes=1.0)
def test_the_small_validation_runs_on_the_small_study(own_study: StudyCopy) -> None:
    found = run_side_study(own_study, "validation") / "small_exam"
    table = pd.read_csv(found / "validation.csv")
    assert set(table["generator"].str[0]) == {"a", "b"}
    assert (table["n"] == 2).all()
    assert (found / "validation.png").stat().st_size > 10_000
