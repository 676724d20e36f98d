"""The validation in its small sizes, on a finished small study."""

import pandas as pd
import pytest
from study_copy import StudyCopy, run_side_study


@pytest.mark.slow(minutes=1.0)
def test_the_small_validation_runs_on_the_small_study(own_study: StudyCopy) -> None:
    found = run_side_study(own_study, "validation") / "small_exam"
    table = pd.read_csv(found / "validation.csv")
    n = table.groupby("generator")["n"].max()
    assert n.to_dict() == {"a: generator of the study": 2, "b: its ranges doubled": 2, "pooled: all": 4}
    assert (found / "validation.png").stat().st_size > 10_000
