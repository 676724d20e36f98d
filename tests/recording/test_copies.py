"""Copies are found, and clean recordings are not taken for copies or clipped, at any resolution."""

from __future__ import annotations

from pathlib import Path

import free_case
import numpy as np
import pytest
from cohorts import recording

from swesbi.recording.problems import RecordingError
from swesbi.recording.quality import clipped
from swesbi.recording.reader import read_samples
from swesbi.recording.tables.layout import SPEED

TWINS, ALLOWED = 200, 1


def refused(path: Path, *, gated: bool) -> bool:
    try:
        if gated:
            read_samples(path, 20, 1000.0)
        else:
            free_case.pushes(path)
    except RecordingError as error:
        assert "has the same" in str(error)
        return True
    return False


@pytest.mark.parametrize("decimals", [1, 3])
def test_clean_twins_are_read_and_copies_are_refused(tmp_path: Path, decimals: int) -> None:
    path, clean, found, twins = tmp_path / "S.csv", 0, 0, TWINS // 2
    for seed in range(twins):
        table = recording(seed).round({SPEED: decimals})
        table.to_csv(path, index=False)
        clean += refused(path, gated=True)
        phase = table["phase_index"] == seed % 20
        copied = table.loc[phase & (table["repeat"] == 0), [SPEED, "status", "fit_r2"]].to_numpy()
        table.loc[phase & (table["repeat"] == 2), [SPEED, "status", "fit_r2"]] = copied
        table.to_csv(path, index=False)
        found += refused(path, gated=True)
    for seed in range(twins):
        train = free_case.train(seed, beats=3.0).round({SPEED: decimals})
        train.to_csv(path, index=False)
        clean += refused(path, gated=False)
    assert clean <= ALLOWED
    assert found >= 0.9 * twins


@pytest.mark.parametrize("decimals", [1, 3])
def test_speeds_are_clipped_where_a_scanner_clips_them(decimals: int) -> None:
    trains = [free_case.train(seed, beats=3.0)[SPEED].round(decimals).to_numpy() for seed in range(TWINS)]
    assert sum(bool(clipped(train)) for train in trains) <= ALLOWED
    limits = [np.round(np.nanquantile(train, 0.8), 1) for train in trains]
    at_limit = [clipped(np.minimum(train, limit)) for train, limit in zip(trains, limits, strict=True)]
    assert sum(map(bool, at_limit)) >= 0.9 * TWINS
    assert all(f"{limit:g} m/s" in said[0] for said, limit in zip(at_limit, limits, strict=True) if said)
