"""The shipped push trains and natural waves are made again to the byte, and are what their README says."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import speed_case
from cohorts import snapshot
from study_copy import ROOT

from swesbi.heart.closures import valve_closures
from swesbi.recording.check import examine_cohort
from swesbi.recording.columns import SPEED
from swesbi.virtual_cohort.natural_waves import BETWEEN, TOLD, natural_waves, wave_volunteers
from swesbi.virtual_cohort.push_trains import write_push_trains
from swesbi.virtual_cohort.settings import ACQUISITION_SEED
from swesbi.virtual_cohort.volunteers import VOLUNTEERS, forward_model_of, simulate_truth

SHIPPED = ROOT / "data" / "virtual_push_trains"


def test_the_push_trains_are_made_again(tmp_path: Path) -> None:
    (tmp_path / "made").mkdir()
    shutil.copy(SHIPPED / TOLD, tmp_path / "made" / TOLD)
    write_push_trains(tmp_path / "made", ACQUISITION_SEED)
    assert snapshot(tmp_path / "made") == snapshot(SHIPPED)


def test_they_are_free_running_and_can_be_used() -> None:
    config = speed_case.shipped()
    report = examine_cohort(SHIPPED, config.recording, config.measurement.grid_points)
    assert [str(problem) for problem in report.problems] == []
    assert len(report.free) == 14
    assert {one.observation.noise_source for one in report.free} == {"declared"}
    trains, waves = tables("[A-H].csv"), tables("W?.csv")
    for table, share in ((trains, 0.46), (waves, 0.2)):
        lost = (table["status"] == "no_wave").mean()
        assert abs(lost - share) < 3.5 * np.sqrt(0.25 / len(table))
    assert (waves.groupby(["event", "beat"]).size() == len(BETWEEN)).all()


def tables(pattern: str) -> pd.DataFrame:
    return pd.concat([pd.read_csv(path) for path in sorted((SHIPPED / "swe").glob(pattern))])


def test_natural_waves_are_of_the_volunteers_own_closures() -> None:
    """Speeds differ from those of the wall at closure by the shared term and errors; 12 terms of 20 %."""
    off = []
    for volunteer in wave_volunteers(ACQUISITION_SEED):
        truth = simulate_truth(volunteer)
        closures = valve_closures(truth.beats, forward_model_of(volunteer))
        made = natural_waves(truth, ACQUISITION_SEED)
        for event, phase in (("mvc", closures.mitral), ("avc", closures.aortic)):
            place = np.searchsorted(truth.curve.cycle_phase, phase[0])
            near = truth.curve.stiffness_kpa[place - 1 : place + 1].mean()
            speed = made.loc[made["event"] == event, SPEED].dropna()
            off.append(np.log(speed / np.sqrt(near / 3.0)).mean())
    assert abs(np.mean(off)) < 3.5 * 0.21 / np.sqrt(12)
    assert 0.08 < np.std(off) < 0.36


def test_wave_volunteers_lie_between_those_whose_parameters_the_prior_holds() -> None:
    prior = speed_case.shipped().priors["calibrated"]
    known = {volunteer.context.subject: volunteer for volunteer in VOLUNTEERS}
    for volunteer in wave_volunteers(ACQUISITION_SEED):
        assert all(
            one.low < value < one.high for value, one in zip(volunteer.theta, prior.parameters, strict=True)
        )
        first, second = (known[name] for name in BETWEEN[volunteer.context.subject])
        assert first.context.sex == second.context.sex == volunteer.context.sex
        for one, low, high in zip(volunteer.theta, first.theta, second.theta, strict=True):
            assert 0.99 * min(low, high) <= one <= 1.01 * max(low, high)
