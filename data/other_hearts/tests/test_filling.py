"""Hearts of another loop whose atria contract, under the model, and under the model without atria."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import speed_case

from data.other_hearts.drawn import StoredHeart, draw_heart
from data.other_hearts.emulated import EmulatedHearts
from data.other_hearts.make import people_of
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings
from swesbi.measurement.speeds import measured_speeds
from swesbi.population.conditions import protocol_noise
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.settings import asking
from swesbi.recording.acquisition import acquire
from swesbi.recording.ingest import ingest
from swesbi.seeds import generator

CONFIG = speed_case.shipped()
STREAM = "filling"
ATRIA = ("atrial_kick_pa", "atrial_delay_s")
NUMBERS = (0, 1, 5)
"""Of the stream; their atria contract by 870 to 980 Pa."""
EFFECTIVE_DRAWS = 200


@cache
def kicked(number: int) -> StoredHeart:
    heart = draw_heart(
        EmulatedHearts(CONFIG.priors["calibrated"]), STREAM, number, people_of(CONFIG), CONFIG.seed
    )
    assert dict(zip(heart.own_names, heart.own, strict=True))["atrial_kick_pa"] > 800.0
    return heart


def without_atria(settings: SpeedModelSettings) -> SpeedModelSettings:
    plain = settings.to_plain()
    for name in ATRIA:
        plain["prior"]["theta"]["nuisances"][name] = None
    return SpeedModelSettings.from_plain(plain)


def log_evidence(heart: StoredHeart, settings: SpeedModelSettings) -> float:
    """Return log p(speeds) of one recording of the heart, to about .3."""
    protocol, rng = CONFIG.acquisition, generator(CONFIG.seed, "tests", STREAM, heart.number)
    other = heart.other_heart()
    samples = acquire(other.curve, other.context, protocol, rng)
    observed = ingest(samples, other.context, CONFIG.recording, settings.measurement.grid_points)
    model = SpeedModel(measured_speeds(observed, protocol_noise(protocol)), settings)
    sizes = asking(speed_case.exact(), EFFECTIVE_DRAWS)
    exact, _ = exact_posterior(HeartModel(model), None, sizes, CONFIG.seed, "tests", heart.number)
    assert exact.sampler == "importance", heart.number
    return exact.weighted.log_evidence


@pytest.mark.slow
def test_a_heart_that_its_atria_fill_asks_for_atria_in_the_model() -> None:
    settings = speed_case.settings("calibrated")
    gain = np.array(
        [
            log_evidence(kicked(number), settings) - log_evidence(kicked(number), without_atria(settings))
            for number in NUMBERS
        ]
    )
    print(f"log evidence higher by {np.round(gain, 1)}")
    assert (gain > 3.0).all()
    assert gain.sum() > 20.0
