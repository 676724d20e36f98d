"""Recordings made anew with acquisition noise, each with its own passive calibration."""

import numpy as np
import pandas as pd
import pytest
from forward_model_cases import SETTINGS as FORWARD_MODEL
from inference_case import CONTEXTS, PAPER_PRIOR
from inference_study import (
    MEASUREMENT,
    PASSIVE,
    RECOVERY,
    SUMMARY,
    TRAIN,
    Inputs,
    make_inputs,
    make_pool,
    measured_subject,
)
from recordings import RECORDING

from swesbi.checks.recovery import acquisition_recovery
from swesbi.heart.simulate import simulate
from swesbi.measurement.operator import late_diastolic
from swesbi.measurement.settings import summary_names
from swesbi.networks.paper.estimator import TrainedEstimator
from swesbi.networks.paper.pool import Pool
from swesbi.networks.paper.training import trained_network
from swesbi.population.recordings import Reacquisition
from swesbi.prior import log_centre
from swesbi.recording.phases import sample_cycle
from swesbi.recording.settings import ACQUISITION, AcquisitionSettings

NOISES = (
    "sample_sd_fraction", "repeat_sd_fraction", "sweep_fraction", "scale_fraction", "rr_sd_fraction",
    "failed_fraction", "outlier_fraction",
)  # fmt: skip
SILENT = ACQUISITION.model_copy(update=dict.fromkeys(NOISES, 0.0))
SETTINGS = {name: value for name, value in RECOVERY.items() if name != "observation_model"} | {
    "reference_prior": PAPER_PRIOR,
    "passive": PASSIVE,
    "recording": RECORDING,
    "acquisition": ACQUISITION,
}
BASELINE = summary_names(SUMMARY).index("baseline_kpa")
CENTRE = log_centre(PAPER_PRIOR)
SLOW_RELAXATION = np.array([58.0, 6.0, 4.0])


def maker(acquisition: AcquisitionSettings, missing_phase: int | None = None) -> Reacquisition:
    context = CONTEXTS[0]
    reference = simulate(CENTRE[None], context, FORWARD_MODEL)
    subject = measured_subject(context, missing_phase)
    return Reacquisition(subject, reference, acquisition, RECORDING, PASSIVE, MEASUREMENT, SUMMARY)


def recorded(theta: np.ndarray, reacquisition: Reacquisition, seed: int = 0) -> np.ndarray:
    beats = simulate(theta[None], CONTEXTS[0], FORWARD_MODEL)
    rng = np.random.default_rng(seed)
    return reacquisition.features(beats.cycle_phase, beats.active_stiffness_kpa[0], rng)


def simulated(theta: np.ndarray, reacquisition: Reacquisition) -> np.ndarray:
    beats = simulate(theta[None], CONTEXTS[0], FORWARD_MODEL)
    active = beats.active_stiffness_kpa
    return reacquisition.subject.simulated_features(beats.cycle_phase, active, SUMMARY)[0]


@pytest.mark.parametrize("missing_phase", [None, 8])
def test_silent_recording_of_the_reference_has_the_simulated_features(missing_phase: int | None) -> None:
    reacquisition = maker(SILENT, missing_phase)
    difference = recorded(CENTRE, reacquisition) - simulated(CENTRE, reacquisition)
    scale = np.maximum(np.abs(simulated(CENTRE, reacquisition)), 1.0)
    assert np.abs(difference / scale).max() < 0.01  # speeds are written with three decimals


def test_passive_baseline_is_taken_from_each_recording() -> None:
    """Whatever relaxes slowly is taken for passive: late diastole then shows the reference's active part."""
    reacquisition = maker(SILENT)
    subject, reference = reacquisition.subject, reacquisition.reference
    assumed = subject.passive.stiffness_kpa + reference.active_stiffness_kpa
    window = late_diastolic(subject.observation, PASSIVE)
    at_phases = sample_cycle(reference.cycle_phase, assumed, subject.observation.phase)[0]
    slow = recorded(SLOW_RELAXATION, reacquisition)[BASELINE]
    assert slow == pytest.approx(at_phases[window].mean(), abs=0.4)
    assert simulated(SLOW_RELAXATION, reacquisition)[BASELINE] > slow + 2.0


def test_noise_of_recordings_is_that_of_the_acquisition() -> None:
    reacquisition = maker(ACQUISITION)
    maximum = summary_names(SUMMARY).index("maximum_kpa")
    spread = [recorded(CENTRE, reacquisition, seed)[maximum] for seed in range(30)]
    # twice the speed's 2.2 % on a phase and 5 % of scale
    assert 0.07 < np.std(spread) / np.mean(spread) < 0.16


@pytest.fixture(scope="module")
def trained() -> tuple[Pool, TrainedEstimator, Inputs]:
    inputs = make_inputs()
    pool = make_pool(inputs)
    return pool, trained_network(pool, **TRAIN, device="cpu").estimator, inputs


def score(trained: tuple[Pool, TrainedEstimator, Inputs], **changed: object) -> pd.DataFrame:
    pool, estimator, inputs = trained
    return acquisition_recovery(pool, estimator, inputs.observations, inputs.passives, **(SETTINGS | changed))


def test_the_stage_repeats_and_scores_no_refused_recording(
    trained: tuple[Pool, TrainedEstimator, Inputs],
) -> None:
    frame = score(trained)
    pd.testing.assert_frame_equal(frame, score(trained), check_exact=True)
    assert frame["n"].between(1, 9).all()
    hopeless = ACQUISITION.model_copy(update={"failed_fraction": 0.99})
    with pytest.raises(ValueError, match="all 9 synthetic recordings were refused"):
        score(trained, acquisition=hopeless)
