from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import speed_case
from makers import check_made_again, maker
from study_copy import ROOT

from swesbi.recording.cohort.check import examine_cohort
from swesbi.recording.settings import ACQUISITION_SEED

SHIPPED = ROOT / "data" / "virtual_push_trains"


def test_the_push_trains_are_made_again(tmp_path: Path) -> None:
    maker("virtual_push_trains").write_push_trains(tmp_path, ACQUISITION_SEED)
    check_made_again("virtual_push_trains", tmp_path)


def test_they_are_free_running_and_can_be_used() -> None:
    config = speed_case.shipped()
    report = examine_cohort(SHIPPED, config.recording, config.measurement.grid_points)
    assert [str(problem) for problem in report.problems] == []
    assert len(report.free_running) == 8
    assert {one.observation.errors_from for one in report.subjects} == {"declared"}
    trains = pd.concat([pd.read_csv(path) for path in sorted((SHIPPED / "swe").glob("*.csv"))])
    lost = (trains["status"] == "no_wave").mean()
    assert abs(lost - 0.46) < 3.5 * np.sqrt(0.25 / len(trains))
