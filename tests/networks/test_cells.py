"""What a network sees of a set of points: cells with their means, missing ones filled, noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import speed_case
from population_case import CELLS

from swesbi.measurement.speeds import SpeedRecording
from swesbi.networks.files import fit_standardisation
from swesbi.networks.flow.conditioning import (
    CellConditioner,
    CellSettings,
    SeenCells,
    cell_inputs,
    context_inputs,
    fill_missing,
    pool_points,
    recording_inputs,
)
from swesbi.recording.phases import nominal_phases

WIDE = CellSettings(cells=20, relative_se=(0.001, 0.5))
RECORDING = speed_case.model().recording


def test_missing_phases_lie_on_the_line_between_their_neighbours_around_the_cycle() -> None:
    measured = np.array([[1, 0, 0, 1, 1, 0], [0, 1, 1, 0, 1, 1]], dtype=bool)
    values = np.array([[1.0, np.nan, np.nan, 4.0, 5.0, np.nan], [np.nan, 1.0, 2.0, np.nan, 4.0, 5.0]])
    expected = [[1.0, 2.0, 3.0, 4.0, 5.0, 3.0], [3.0, 1.0, 2.0, 3.0, 4.0, 5.0]]
    assert np.allclose(fill_missing(values, measured), expected)


def points(phase: list[float], log_speed: list[float], se: list[float]) -> SpeedRecording:
    return replace(
        RECORDING,
        phase=np.array(phase),
        speed_m_s=np.exp(log_speed),
        relative_se=np.array(se),
        shared=np.empty((len(phase), 0)),
    )


def named(recording: SpeedRecording) -> dict[str, float]:
    row = recording_inputs(recording, WIDE)[0]
    return dict(zip(WIDE.components, row.tolist(), strict=True))


def test_a_recording_at_nominal_phases_is_seen_as_it_is() -> None:
    phase = nominal_phases(20)
    measured = np.ones(20, dtype=bool)
    measured[[4, 13]] = False
    log_speed, se = np.linspace(0.0, 1.0, 20), np.linspace(0.02, 0.05, 20)
    gated = points(list(phase[measured]), list(log_speed[measured]), list(se[measured]))
    zero = np.zeros((1, 20))
    seen = SeenCells(log_speed[None], measured[None], se[None], zero, np.zeros(1))
    expected = cell_inputs(context_inputs(gated.context)[None], seen, WIDE)
    np.testing.assert_allclose(recording_inputs(gated, WIDE), expected, atol=1e-13)
    assert expected.shape == (1, len(WIDE.components)) == (1, 84)
    told = named(gated)
    assert (told["missing_cell_04"], told["missing_cell_05"]) == (1.0, 0.0)
    assert told["log_speed_cell_04"] == pytest.approx(log_speed[4])
    assert told["log_hr_bpm"] == pytest.approx(np.log(gated.context.hr_bpm))


def test_points_of_a_cell_count_by_their_errors() -> None:
    told = named(points([0.01, 0.04, 0.5, 0.77], [1.0, 2.0, 0.3, 0.4], [0.1, 0.05, 0.1, 0.1]))
    assert told["log_speed_cell_00"] == pytest.approx((1.0 + 4.0 * 2.0) / 5.0)
    assert told["offset_cell_00"] == pytest.approx((0.01 + 4.0 * 0.04) / 5.0 * 20 - 0.5)
    assert told["log_relative_se_cell_00"] == pytest.approx(np.log((1 / 0.1**2 + 1 / 0.05**2) ** -0.5))
    assert told["log_speed_cell_10"] == pytest.approx(0.3)
    assert sum(told[f"missing_cell_{k:02d}"] for k in range(20)) == 17.0


def test_the_order_of_the_points_does_not_matter() -> None:
    rng = np.random.default_rng(8)
    phase, speed, se = rng.random(40), rng.normal(size=40), rng.uniform(0.02, 0.2, 40)
    one = points(list(phase), list(speed), list(se))
    order = rng.permutation(40)
    other = points(list(phase[order]), list(speed[order]), list(se[order]))
    np.testing.assert_allclose(recording_inputs(one, WIDE), recording_inputs(other, WIDE), atol=1e-12)


def test_several_recordings_are_pooled_each_by_itself() -> None:
    rng = np.random.default_rng(9)
    row, phase, se = np.repeat([0, 1, 2], [3, 30, 7]), rng.random(40), rng.uniform(0.02, 0.2, 40)
    together = pool_points(row, phase, se, 3, 20)
    for number in range(3):
        own = row == number
        alone = pool_points(np.zeros(own.sum(), dtype=int), phase[own], se[own], 1, 20)
        np.testing.assert_array_equal(together.measured[number], alone.measured[0])
        np.testing.assert_allclose(together.offset[number], alone.offset[0], atol=1e-12)
        np.testing.assert_allclose(together.relative_se[number], alone.relative_se[0])


def test_a_factor_of_all_errors_is_told() -> None:
    recording = points([0.1, 0.3], [0.0, 1.0], [0.1, 0.1])
    assert named(replace(recording, errors_log_sd=0.3))["errors_log_sd"] == 0.3
    assert named(recording)["errors_log_sd"] == 0.0


@pytest.mark.parametrize(("phases", "missing"), [(10, 10), (20, 0), (25, 0)])
def test_other_numbers_of_phases_are_seen_too(phases: int, missing: int) -> None:
    other = points(list(nominal_phases(phases)), list(0.01 * np.arange(phases)), [0.03] * phases)
    told = named(other)
    assert sum(told[f"missing_cell_{k:02d}"] for k in range(20)) == missing


def test_the_network_sees_the_total_standard_error() -> None:
    recording = replace(RECORDING, shared=np.full((len(RECORDING.phase), 2), 0.01))
    total = np.sqrt(RECORDING.relative_se**2 + 2.0 * 0.01**2)
    told = named(recording)
    assert [told[f"log_relative_se_cell_{k:02d}"] for k in range(20)] == pytest.approx(np.log(total))


def test_noise_beyond_what_was_trained_on_is_shown_at_its_limit() -> None:
    settings = CellSettings(cells=20, relative_se=(0.02, 0.04))
    loud = replace(RECORDING, relative_se=np.full(len(RECORDING.phase), 0.5))
    told = dict(zip(settings.components, recording_inputs(loud, settings)[0], strict=True))
    assert told["log_relative_se_cell_03"] == pytest.approx(np.log(0.04))


def test_far_recordings_are_clipped() -> None:
    rng = np.random.default_rng(1)
    conditioner = CellConditioner(CELLS, fit_standardisation(rng.normal(size=(100, 84))))
    assert np.abs(conditioner.standardise(np.full((1, 84), 1e6))).max() == 8.0
