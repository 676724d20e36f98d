"""The readings in their small sizes, on a finished small study."""

import pandas as pd
import pytest
from study_copy import ROOT, StudyCopy, run_side_study

from swesbi.config.read import read_yaml


@pytest.mark.slow(minutes=1.0)
def test_the_small_readings_run_on_the_small_study(own_study: StudyCopy) -> None:
    found = run_side_study(own_study, "readings")
    readings = read_yaml(ROOT / "studies" / "readings" / "config.yaml")["readings"]
    table = pd.read_csv(found / "readings.csv")
    kept = ["base", "noise_quarter", "robust", "robust_curve_noise_quarter_stretch"]
    assert list(table["reading"]) == ["paper", *kept]
    verdicts = pd.read_csv(found / "readings_verdicts.csv")
    assert set(verdicts["reading"]) == set(readings["acquisition_seeds"])
    assert set(verdicts["recordings"]) == {2}
    weights = pd.read_csv(found / "readings_weights.csv")
    assert list(weights["correlation_weight"]) == [1.0, 1.0] * len(readings["cmaes"]["readings"])
    assert (found / "readings.png").stat().st_size > 10_000
