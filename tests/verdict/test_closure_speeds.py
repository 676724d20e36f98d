"""The rule on natural waves decides by what is drawn; the shipped model makes aortic speeds alone."""

from __future__ import annotations

import numpy as np
import pytest
import speed_case

from swesbi.__main__ import main
from swesbi.config.natural_waves import natural_waves_of
from swesbi.population.settings import PopulationSettings
from swesbi.verdict.closure_speeds import closure_speeds, judged, prior_predictive
from swesbi.verdict.settings import NaturalWavesSettings

CHOSEN = natural_waves_of(speed_case.shipped())
WAVES = NaturalWavesSettings.from_plain(CHOSEN["natural_waves"])
HEALTHY = PopulationSettings.from_plain(CHOSEN["healthy"])
FEWER = WAVES.model_copy(update={"contexts": 8, "draws_per_context": 16})


def test_waves_are_interpreted_where_every_published_mean_lies_within() -> None:
    spread = np.exp(0.3 * np.random.default_rng(0).standard_normal(4000))
    outcome = judged({"mvc": 1.3 * spread, "avc": 3.3 * spread}, WAVES)
    assert [one.interpretable for one in outcome] == [False, True]
    assert [known.mean_m_s for known in outcome[0].missed] == [3.2, 4.68]
    assert "the model predicts 0.80 to 2.13 m/s" in outcome[0].why_not()
    # a prediction that holds one of two means holds not enough
    outcome = judged({"mvc": 3.2 * spread**0.5, "avc": 3.3 * spread}, WAVES)
    assert [known.mean_m_s for known in outcome[0].missed] == [4.68]
    assert not outcome[0].interpretable
    outcome = judged({"mvc": 3.9 * spread, "avc": 9.0 * spread}, WAVES)
    assert [one.interpretable for one in outcome] == [True, False]


def test_the_shipped_model_makes_the_speeds_after_aortic_closure_alone() -> None:
    mitral, aortic = closure_speeds(speed_case.settings("calibrated"), HEALTHY, FEWER, 20260)
    assert not mitral.interpretable
    assert aortic.interpretable
    assert mitral.high < 3.0 < aortic.median < 3.6


def test_hearts_are_healthy_adults_and_draws_those_of_the_seed() -> None:
    assert list(HEALTHY.groups) == ["adults"]
    few = WAVES.model_copy(update={"contexts": 2, "draws_per_context": 4})
    drawn = [prior_predictive(speed_case.settings("calibrated"), HEALTHY, few, seed) for seed in (1, 1, 2)]
    np.testing.assert_array_equal(drawn[0]["avc"], drawn[1]["avc"])
    assert not np.array_equal(drawn[0]["avc"], drawn[2]["avc"])


def test_the_command_prints_the_outcome(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["closures", "--overlay", "tests/smoke.yaml"]) == 0
    said = capsys.readouterr().out
    assert "mvc: not interpretable\navc: interpreted\n" in said
    assert "Santos et al., IEEE Trans Ultrason Ferroelectr Freq Control 2019;66:442" in said
