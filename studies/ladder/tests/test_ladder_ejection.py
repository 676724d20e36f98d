"""Whether a structure's prior predictive ejects as people do, which decides what an ejection time may be."""

from __future__ import annotations

import numpy as np
import pytest
from forward_model_cases import COHORT
from ladder_case import LADDER
from speed_case import ROOT

from studies.ladder.ejection import holds_published, prior_predictive_lvet_ms
from swesbi.config.models import Config
from swesbi.config.read import read_merged
from swesbi.config.study import load_study
from swesbi.heart.intervals import systolic_intervals
from swesbi.heart.simulate import simulate
from swesbi.prior import NuisanceSettings

DRAWS = 60
CONTEXTS = tuple(COHORT.values())
PAGE = (ROOT / "studies" / "ladder" / "README.md").read_text(encoding="utf-8")


def configured(structure: str) -> Config:
    raw = read_merged(ROOT / "config.yaml") | {"cohort": str(ROOT / "data" / "virtual_volunteers")}
    study = load_study(raw)
    return study.with_changes(LADDER.structures[structure].changes, "test").config


@pytest.mark.parametrize(("structure", "holds"), [("base", False), ("physiological_timing", True)])
def test_the_shipped_structure_ejects_too_briefly_and_physiological_timing_does_not(
    structure: str, holds: bool
) -> None:
    config = configured(structure)
    lvet_ms = prior_predictive_lvet_ms(
        CONTEXTS, config.priors["calibrated"], config.forward_model, DRAWS, config.seed
    )
    assert lvet_ms.shape == (len(CONTEXTS), DRAWS)
    assert holds_published(lvet_ms) is holds
    # the page's median is over more contexts
    median = 298.0 if holds else 219.0
    assert f"{median:.0f} ms" in PAGE
    assert np.nanmedian(lvet_ms) == pytest.approx(median, abs=25.0)
    assert np.isfinite(lvet_ms).mean() > 0.95


def test_without_free_physiology_each_heart_is_that_of_its_theta() -> None:
    config = configured("base")
    prior = config.priors["calibrated"].model_copy(update={"nuisances": NuisanceSettings()})
    narrow = {
        name: getattr(prior, name).model_copy(update={"log_sd": 1e-6})
        for name in ("k0_kpa", "k_atp_per_s", "k_sr_per_s")
    }
    prior = prior.model_copy(update=narrow)
    found = prior_predictive_lvet_ms(CONTEXTS[:2], prior, config.forward_model, 3, 1)
    for times, context in zip(found, CONTEXTS[:2], strict=True):
        centre = simulate(np.array([[45.0, 5.0, 30.0]]), context, config.forward_model)
        expected = 1e3 * systolic_intervals(centre, context.period_s).ejection_s[0]
        np.testing.assert_allclose(times, expected, atol=1e-6)


@pytest.mark.parametrize(
    ("times", "holds"),
    [([250.0, 270.0, 400.0], True), ([250.0, 259.0, 300.0], False), ([321.0, 330.0], False)],
)
def test_the_median_decides_and_hearts_without_ejection_do_not_count(times: list[float], holds: bool) -> None:
    assert holds_published(np.array([*times, np.nan])) is holds


def test_a_prior_without_any_ejection_is_refused() -> None:
    with pytest.raises(ValueError, match="no heart of the prior ejects"):
        holds_published(np.full(3, np.nan))
