"""Which natural waves the configured model interprets, told without asking any recording."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from swesbi.config.models import Config
from swesbi.population.settings import of_group
from swesbi.verdict.settings import NaturalWavesSettings

if TYPE_CHECKING:
    from swesbi.verdict.closure_speeds import ClosureSpeeds


def natural_waves_of(config: Config) -> dict[str, Any]:
    """Return when natural waves are interpreted, and the healthy hearts on which that rests."""
    chosen = config.natural_waves
    population = config.population_experiments[chosen.experiment].population
    waves = {
        key: value for key, value in chosen.to_plain().items() if key in NaturalWavesSettings.model_fields
    }
    return {"natural_waves": waves, "healthy": of_group(population, chosen.group).to_plain()}


def closures_under(config: Config, model: Mapping[str, Any]) -> tuple[ClosureSpeeds, ...]:
    """Return what the waves of each event mean under a model; told once in a process, after some seconds.

    Args:
        config: Says when waves are interpreted.
        model: Plain settings of the model of an experiment.
    """
    return _closures(json.dumps({"model": model, **natural_waves_of(config)}, sort_keys=True), config.seed)


@lru_cache
def _closures(settings: str, seed: int) -> tuple[ClosureSpeeds, ...]:
    # the simulator takes seconds to import, and few have natural waves
    from swesbi.measurement.likelihood import SpeedModelSettings
    from swesbi.population.settings import PopulationSettings
    from swesbi.verdict.closure_speeds import closure_speeds

    plain = json.loads(settings)
    return closure_speeds(
        SpeedModelSettings.from_plain(plain["model"]),
        PopulationSettings.from_plain(plain["healthy"]),
        NaturalWavesSettings.from_plain(plain["natural_waves"]),
        seed,
    )


def why_not_interpreted(outcome: Sequence[ClosureSpeeds], events: Sequence[str]) -> str:
    """Return why none of these waves is interpreted; empty where some are, or there are none."""
    own = [one for one in outcome if one.event in events]
    return "" if any(one.interpretable for one in own) else "; ".join(one.why_not() for one in own)
