"""The version of the model moves with physics, prior and noise, and with nothing else."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swesbi.config.read import read_merged
from swesbi.config.study import Study, load_study
from tools import model_version
from tools.model_version import (
    FINGERPRINT,
    STORED,
    ModelVersionError,
    check_version,
    fingerprint,
    moved,
    read_versions,
    renew,
    store_tables,
)


@cache
def shipped() -> Study:
    return load_study(read_merged(Path("config.yaml"), None))


@cache
def found() -> dict[str, float]:
    return fingerprint(shipped())


def test_the_stored_fingerprint_is_that_of_the_model() -> None:
    assert len(found()) > 100
    check_version(STORED, found())


@pytest.mark.parametrize(
    "changes",
    [
        {"forward_model": {"wall_viscosity_pa_s": 70.01}},
        {"priors": {"calibrated": {"nuisances": {"sigma_0_pa": {"log_sd": 0.1201}}}}},
        {"acquisition": {"sample_sd_fraction": 0.0601}},
        {"experiments": {"calibrated": {"observation_model": {"discrepancy": {"speed_fraction": 0.021}}}}},
    ],
    ids=["physics", "prior", "noise", "discrepancy"],
)
def test_it_moves_with_what_ages_a_table(changes: dict[str, Any]) -> None:
    assert moved(found(), fingerprint(shipped().with_changes(changes, "changed")))


def test_names_paths_and_networks_leave_it_as_it_is() -> None:
    network = {"amortised": {"estimator": {"epochs": 1}}}
    changes = {"results": "elsewhere", "cohort_title": "others", "population_experiments": network}
    assert not moved(found(), fingerprint(shipped().with_changes(changes, "changed")))


def test_a_moved_model_needs_another_version(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before, after = {"a": 1.0, "b": -300.0}, {"a": 1.0, "b": -300.01}
    renew(tmp_path, before)
    check_version(tmp_path, {"a": 1.0 + 1e-8, "b": -300.0})
    with pytest.raises(ModelVersionError, match=r"1 of 2, first b.*raise MODEL_VERSION"):
        check_version(tmp_path, after)
    with pytest.raises(ModelVersionError, match="raise MODEL_VERSION"):
        renew(tmp_path, after)
    assert json.loads((tmp_path / FINGERPRINT).read_text())["values"] == before
    monkeypatch.setattr(model_version, "MODEL_VERSION", 1_000)
    with pytest.raises(ModelVersionError, match="MODEL_VERSION is 1000"):
        check_version(tmp_path, before)
    renew(tmp_path, after)
    check_version(tmp_path, after)
    assert moved(before, {"a": 1.0, "b": np.nan}) == ["b"]


def test_tables_are_stored_with_the_version_that_made_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tables = [tmp_path / "calibrated" / "recovery.csv", tmp_path / "amortised" / "strata.csv"]
    for number, table in enumerate(tables):
        table.parent.mkdir()
        table.write_text(f"n\n{number}\n")
    monkeypatch.setattr(model_version, "MODEL_VERSION", 1)
    store_tables(tmp_path, tables)
    monkeypatch.setattr(model_version, "MODEL_VERSION", 2)
    store_tables(tmp_path, tables[:1])
    assert (tmp_path / "calibrated_recovery.csv").read_bytes() == tables[0].read_bytes()
    assert read_versions(tmp_path) == {"amortised_strata": 1, "calibrated_recovery": 2}
