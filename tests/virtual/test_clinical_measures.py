from __future__ import annotations

from dataclasses import astuple

import numpy as np
import pandas as pd
import pytest
from speed_case import shipped
from study_copy import ROOT

from data.makers.clinical import CLINICAL_ERRORS, measure, true_measures, with_errors
from swesbi.recording.cohort.clinical import ClinicalMeasures
from swesbi.recording.cohort.subjects import read_subject_table
from swesbi.recording.settings import ACQUISITION_SEED
from swesbi.virtual.volunteers import VOLUNTEERS, Volunteer, simulate_truth

SHIPPED = ROOT / "data" / "virtual_volunteers"
TRUTH = pd.read_csv(SHIPPED / "truth.csv").set_index("subject")
IN_TRUTH = ("systolic_aortic_pressure_mmhg", "diastolic_aortic_pressure_mmhg", "ejection_ms")
named = pytest.mark.parametrize("volunteer", VOLUNTEERS, ids=lambda one: one.context.subject)


def test_the_errors_are_those_that_the_configuration_says() -> None:
    assert shipped().clinical.model_dump().items() >= CLINICAL_ERRORS.model_dump().items()


@named
def test_the_shipped_columns_are_the_true_beat_with_such_errors(volunteer: Volunteer) -> None:
    name = volunteer.context.subject
    truth = simulate_truth(volunteer)
    columns = read_subject_table(SHIPPED / "subjects.csv").clinical[name].to_measures()
    assert columns == measure(truth, ACQUISITION_SEED)
    true = true_measures(truth)
    listed = TRUTH.loc[name, list(IN_TRUTH)].to_numpy(dtype=float)
    np.testing.assert_allclose(listed, (true.sbp_mmhg, true.dbp_mmhg, true.lvet_ms), atol=0.06)
    assert truth.beats.ventricular_pressure_mmhg.max() == pytest.approx(true.sbp_mmhg, rel=0.03)


def test_errors_have_their_bias_and_spread_and_are_independent() -> None:
    rng, true = np.random.default_rng(1), ClinicalMeasures(120.0, 75.0, 290.0)
    drawn = np.array([astuple(with_errors(true, CLINICAL_ERRORS, rng)) for _ in range(4000)])
    error = drawn - np.array(astuple(true))
    np.testing.assert_allclose(error.mean(axis=0), [0.3, 4.5, 0.0], atol=0.5)
    np.testing.assert_allclose(error.std(axis=0), [10.0, 8.0, 10.0], rtol=0.05)
    assert np.abs(np.corrcoef(error.T) - np.eye(3)).max() < 0.05
    np.testing.assert_array_equal(drawn, np.round(drawn))
