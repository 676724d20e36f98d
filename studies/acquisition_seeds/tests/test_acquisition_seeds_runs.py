"""The study over acquisition seeds in its small sizes, on a finished small study."""

import pandas as pd
import pytest
from study_copy import StudyCopy, run_side_study


@pytest.mark.slow(minutes=0.5)
def test_the_small_study_over_acquisition_seeds_runs_on_the_small_study(own_study: StudyCopy) -> None:
    found = run_side_study(own_study, "acquisition_seeds")
    recordings = pd.read_csv(found / "acquisition_seeds.csv")
    medians = pd.read_csv(found / "acquisition_seeds_medians.csv")
    assert set(recordings["acquisition_seed"]) == {1, 2}
    assert list(medians["subject"]) == list(dict.fromkeys(recordings["subject"]))
    assert (medians["seeds"] == 2).all()
