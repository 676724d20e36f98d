"""What more repeats would buy: as much as their errors weigh beside the model's, and no more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import speed_case

from swesbi.checks.identifiability.more_repeats import MoreRepeats, more_repeats
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.parameters import REPORTED_NAMES

STEP = 0.02
A = REPORTED_NAMES.index("passive_stiffness_kpa")
PHI = np.tile(speed_case.PHI, (2, 1))
NONE = DiscrepancySettings(speed_fraction=0.0, timing_cycle=0.0)


def _found(model: SpeedModel) -> MoreRepeats:
    found = more_repeats(model, PHI, STEP)
    assert found is not None
    return found


def _with(model: SpeedModel, discrepancy: DiscrepancySettings, relative_se: float) -> SpeedModel:
    recording = model.recording
    smaller = replace(recording, relative_se=np.full(len(recording.phase), relative_se))
    settings = model.settings.model_copy(update={"discrepancy": discrepancy})
    return replace(model, recording=smaller, settings=settings)


def test_without_errors_of_the_model_intervals_narrow_as_the_root_of_the_repeats() -> None:
    found = _found(_with(speed_case.model(), NONE, 1e-4))
    assert found.width[:, A] == pytest.approx(np.array(found.times) ** -0.5, rel=0.02)


def test_errors_of_the_model_are_not_averaged_away() -> None:
    exact = _with(speed_case.model(), DiscrepancySettings(speed_fraction=0.1, timing_cycle=0.0), 1e-3)
    assert (_found(exact).width > 0.999).all()


def test_every_step_buys_less_than_the_one_before() -> None:
    width = _found(speed_case.model()).width
    assert (width[0] < 1.0).all()
    assert (np.diff(width, axis=0) < 0.0).all()
    assert (width > np.array([2.0, 4.0, 8.0])[:, None] ** -0.5).all()


def test_pushes_of_one_instant_count_as_their_mean() -> None:
    """Three pushes of a cell with errors sqrt(3) as large tell what one tells, now and with more of them."""
    plain = _with(speed_case.model(), speed_case.model().settings.discrepancy, 0.05)
    recording = plain.recording
    thrice = replace(
        recording,
        phase=np.repeat(recording.phase, 3),
        speed_m_s=np.repeat(recording.speed_m_s, 3),
        relative_se=np.full(60, 0.05 * np.sqrt(3.0)),
        shared=np.empty((60, 0)),
        cell=np.repeat(np.arange(20), 3),
    )
    pushes = _found(replace(plain, recording=thrice))
    np.testing.assert_allclose(pushes.width, _found(plain).width, rtol=0.01)
    apart = _found(replace(plain, recording=replace(thrice, cell=np.arange(60))))
    assert (apart.width < pushes.width - 0.005).any()


def test_what_sweeps_share_becomes_less_with_more_of_them() -> None:
    shipped = speed_case.model_of_sweeps()
    settings = shipped.settings.model_copy(update={"discrepancy": NONE})
    recording = replace(shipped.recording, relative_se=np.full(20, 1e-4), shared=np.full((20, 1), 1e-3))
    found = _found(replace(shipped, recording=recording, settings=settings))
    assert found.width[:, A] == pytest.approx(np.array(found.times) ** -0.5, rel=0.02)
