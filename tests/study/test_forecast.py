"""What a run is expected to take: stored costs, scaled by the speed of the machine."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from study_copy import ROOT, copy_study

from swesbi.study import forecast
from swesbi.study.forecast import Run, StageCost, expected_s, read_costs

COSTS = {"train": StageCost(200.0, 1.0), "draw": StageCost(5.0, 1.0)}


def test_jobs_fill_the_cores_of_a_machine_of_another_speed() -> None:
    stages = ["train", *["draw"] * 80]
    assert expected_s(stages, 2, COSTS, 1.0) == pytest.approx(300.0)
    assert expected_s(stages, 2, COSTS, 1.5) == pytest.approx(450.0)
    # no run is shorter than a job
    assert expected_s(["train", "draw"], 2, COSTS, 1.0) == pytest.approx(200.0)
    assert expected_s(["train", "unknown"], 2, COSTS, 1.0) is None


def test_the_costs_are_those_of_one_run(tmp_path: Path) -> None:
    table = pd.DataFrame(
        {"stage": ["draw"], "jobs": [1], "runs": [4], "wall_s": [20.0], "benchmark_s": [0.8]}
    )
    table.to_csv(tmp_path / "costs.csv", index=False)
    assert read_costs(tmp_path / "costs.csv") == {"draw": StageCost(5.0, 0.8)}


def test_a_run_says_what_it_will_take_and_what_it_took(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = pd.DataFrame(
        {"stage": ["draw"], "jobs": [1], "runs": [1], "wall_s": [60.0], "benchmark_s": [1.0]}
    )
    table.to_csv(tmp_path / "costs.csv", index=False)
    monkeypatch.setattr(forecast, "benchmark_s", lambda: 2.0)
    run = Run(tmp_path / "costs.csv")
    assert run.begun([["draw"], ["draw"] * 3], 2) == "2 jobs, about 4 min here"
    assert run.ended() == "The run took 0 s; 4 min were expected"
    of_a_cluster, other_settings = Run(tmp_path / "costs.csv"), Run(None)
    assert of_a_cluster.begun([["draw"]] * 4, None) == other_settings.begun([["draw"]] * 4, 2) == "4 jobs"


def test_every_job_of_the_study_has_a_stored_cost(tmp_path: Path) -> None:
    """The small study has the rules of the study as it is shipped; the rule `all` runs nothing."""
    rules = {job.rule for job in copy_study(tmp_path).planned()} - {"all"}
    assert len(rules) > 45
    assert rules <= set(read_costs(ROOT / "docs" / "tables" / "study_cost.csv"))
