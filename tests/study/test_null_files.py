"""Which null recordings an experiment is judged among: the package's for its model, else the study's own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from study_copy import ROOT

from swesbi.config.read import ConfigError, read_merged
from swesbi.config.study import Study, load_study
from swesbi.config.view import nulls_of
from swesbi.verdict.settings import SHIPPED_NULLS


def changed(changes: dict[str, Any], path: Path) -> Study:
    overlay = path / "other.yaml"
    overlay.write_text(str(changes), encoding="utf-8")
    return load_study(read_merged(ROOT / "config.yaml", overlay))


@pytest.mark.parametrize("experiment", ["calibrated", "amortised"])
def test_the_package_has_the_nulls_of_the_shipped_model(experiment: str, tmp_path: Path) -> None:
    other = {"experiments": {"calibrated": {"exact": {"draws": 4000}}}, "recording": {"min_fit_r2": 0.5}}
    assert nulls_of(changed(other, tmp_path), experiment) == SHIPPED_NULLS


@pytest.mark.parametrize(
    "model",
    [
        {"forward_model": {"length_dependence": 0.5}},
        {"priors": {"calibrated": {"k0_kpa": {"centre": 70.0}}}},
        {"experiments": {"calibrated": {"observation_model": {"discrepancy": {"speed_fraction": 0.03}}}}},
    ],
)
def test_another_model_has_nulls_by_the_network_of_its_population_and_none_without_it(
    model: dict[str, Any], tmp_path: Path
) -> None:
    study = changed(model, tmp_path)
    for experiment in ("calibrated", "amortised"):
        assert nulls_of(study, experiment) == Path("results/amortised/null.h5")
    alone = study.config.model_copy(update={"population_experiments": {}})
    object.__setattr__(study, "config", alone)
    with pytest.raises(ConfigError, match=r"need null recordings.*`base: calibrated`"):
        nulls_of(study, "calibrated")
