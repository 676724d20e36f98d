"""The choice of the discrepancy in its small sizes, beside a finished small study."""

import pandas as pd
import pytest
from study_copy import StudyCopy, run_side_study


@pytest.mark.slow(minutes=0.5)
def test_the_small_choice_runs_with_the_small_study(own_study: StudyCopy) -> None:
    found = run_side_study(own_study, "discrepancy")
    table = pd.read_csv(found / "discrepancy.csv")
    assert table["subjects"].tolist() == [2] * 4
    assert table["log_evidence"].notna().all()
    assert (found / "discrepancy.png").stat().st_size > 10_000
