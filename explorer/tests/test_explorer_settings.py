"""What the page depends on: the model, criteria of posteriors and recordings, and what it calls them."""

from __future__ import annotations

from typing import Any, cast

import pytest
from study_copy import ROOT

from swesbi.config.read import ConfigError, read_merged
from swesbi.config.study import Study, load_study
from swesbi.config.view import View
from swesbi.study.stage import plain_settings

SHIPPED = read_merged(ROOT / "config.yaml") | {"cohort": str(ROOT / "data" / "virtual_volunteers")}
STUDY = load_study(SHIPPED)
OWN = "experiments.calibrated"


def page_settings(study: Study, experiment: str) -> dict[str, Any]:
    return plain_settings("explorer.stages:explorer", View(study, {"experiment": experiment}))


def settings_with(key: str, value: object) -> dict[str, Any]:
    """Return the page's settings where one value of the configuration is another."""
    changes = value
    for part in reversed(key.split(".")):
        changes = {part: changes}
    return page_settings(STUDY.with_changes(cast(dict[str, Any], changes), "a test"), "calibrated")


@pytest.mark.parametrize(
    ("key", "value"),
    [
        (f"{OWN}.misspecification.rule.doubtful_level", 0.04),
        (f"{OWN}.exact.min_effective_draws", 333),
        (f"{OWN}.observation_model.discrepancy.speed_fraction", 0.001),
        (f"{OWN}.passive_stiffness_kpa.log_sd", 0.3),
        ("priors.calibrated.nuisances.passive_ratio.log_sd", 0.3),
        ("recording.min_samples_per_phase", 1),
        ("forward_model.steps_per_beat", 600),
    ],
)
def test_what_the_page_uses_reaches_it(key: str, value: object) -> None:
    assert settings_with(key, value) != page_settings(STUDY, "calibrated")


@pytest.mark.parametrize(
    ("key", "value"),
    [
        (f"{OWN}.estimator.learning_rate", 0.0077),
        ("passive.exponent_b", 1.0),
        ("seed", 3),
        ("resources.device", "cpu"),
    ],
)
def test_what_it_does_not_use_does_not(key: str, value: object) -> None:
    assert settings_with(key, value) == page_settings(STUDY, "calibrated")


def test_an_experiment_that_is_none_is_refused() -> None:
    with pytest.raises(ConfigError, match="no_such"):
        page_settings(STUDY, "no_such")
