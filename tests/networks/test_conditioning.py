"""What a network sees phase by phase: missing phases filled around the cycle, noise, and where it lies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import speed_case
from population_case import PHASES

from swesbi.networks.spline.conditioning import (
    PhaseSettings,
    context_inputs,
    fill_missing,
    fit_phase_conditioner,
    phase_inputs,
    recording_inputs,
)
from swesbi.recording.phases import nominal_phases

RECORDING = speed_case.model().recording


def test_missing_phases_lie_on_the_line_between_their_neighbours_around_the_cycle() -> None:
    measured = np.array([[1, 0, 0, 1, 1, 0], [0, 1, 1, 0, 1, 1]], dtype=bool)
    values = np.array([[1.0, np.nan, np.nan, 4.0, 5.0, np.nan], [np.nan, 1.0, 2.0, np.nan, 4.0, 5.0]])
    expected = [[1.0, 2.0, 3.0, 4.0, 5.0, 3.0], [3.0, 1.0, 2.0, 3.0, 4.0, 5.0]]
    assert np.allclose(fill_missing(values, measured), expected)


def test_a_line_is_filled_exactly_wherever_the_gap_lies() -> None:
    rng = np.random.default_rng(2)
    measured = rng.random((200, 20)) < 0.8
    measured[:, [0, 19]] = True
    line = rng.normal(size=(200, 1)) + rng.normal(size=(200, 1)) * np.arange(20)
    filled = fill_missing(np.where(measured, line, np.nan), measured)
    assert np.allclose(filled, line)


def test_a_recording_at_nominal_phases_is_seen_as_it_is() -> None:
    phase = nominal_phases(20)
    measured = np.ones(20, dtype=bool)
    measured[[4, 13]] = False
    speed, se = np.linspace(1.0, 3.0, 20), np.linspace(0.02, 0.05, 20)
    recording = replace(
        RECORDING,
        phase=phase[measured],
        speed_m_s=speed[measured],
        relative_se=se[measured],
        shared=np.empty((18, 0)),
    )
    expected = phase_inputs(
        context_inputs(recording.context)[None], np.log(speed)[None], measured[None], se[None], PHASES
    )
    assert np.array_equal(recording_inputs(recording, PHASES), expected)
    assert expected.shape == (1, len(PHASES.components)) == (1, 63)
    named = dict(zip(PHASES.components, expected[0], strict=True))
    assert named["missing_phase_04"] == 1.0
    assert named["missing_phase_05"] == 0.0
    assert named["log_hr_bpm"] == pytest.approx(np.log(recording.context.hr_bpm))


def test_phases_that_are_a_little_off_count_where_they_are_nearest() -> None:
    phase = (nominal_phases(20) + 0.004 * np.sin(np.arange(20))) % 1.0
    recording = replace(
        RECORDING,
        phase=phase,
        speed_m_s=np.linspace(1.0, 2.0, 20),
        relative_se=np.full(20, 0.03),
        shared=np.empty((20, 0)),
    )
    assert np.array_equal(recording_inputs(recording, PHASES)[0, 3:23], np.log(recording.speed_m_s))


@pytest.mark.parametrize(("phases", "missing"), [(10, 10), (20, 0), (25, 0)])
def test_other_numbers_of_phases_are_seen_too_and_none_counts_twice(phases: int, missing: int) -> None:
    speeds = np.exp(0.01 * np.arange(phases))
    other = replace(
        RECORDING,
        phase=nominal_phases(phases),
        speed_m_s=speeds,
        relative_se=np.full(phases, 0.03),
        shared=np.empty((phases, 0)),
    )
    inputs = recording_inputs(other, PHASES)[0]
    assert inputs[23:43].sum() == missing
    seen = inputs[3:23][inputs[23:43] == 0.0]
    assert len(set(seen.tolist())) == len(seen)
    assert set(seen.tolist()) <= set(np.log(speeds).tolist())


def test_the_network_sees_the_total_standard_error() -> None:
    recording = replace(RECORDING, shared=np.full((len(RECORDING.phase), 2), 0.01))
    settings = PhaseSettings(phases=20, relative_se=(0.001, 0.5))
    total = np.sqrt(RECORDING.relative_se**2 + 2.0 * 0.01**2)
    np.testing.assert_allclose(recording_inputs(recording, settings)[0, -20:], np.log(total))
    same = recording_inputs(replace(RECORDING, shared=np.empty((20, 0))), settings)[0, -20:]
    np.testing.assert_array_equal(same, np.log(RECORDING.relative_se))


def test_noise_beyond_what_was_trained_on_is_shown_at_its_limit() -> None:
    settings = PhaseSettings(phases=20, relative_se=(0.02, 0.04))
    loud = replace(RECORDING, relative_se=np.full(len(RECORDING.phase), 0.5))
    inputs = recording_inputs(loud, settings)[0, -20:]
    assert inputs.max() == pytest.approx(np.log(0.04))


def test_far_recordings_are_clipped() -> None:
    rng = np.random.default_rng(1)
    conditioner = fit_phase_conditioner(rng.normal(size=(100, 63)), PHASES)
    assert np.abs(conditioner.standardise(np.full((1, 63), 1e6))).max() == 8.0
