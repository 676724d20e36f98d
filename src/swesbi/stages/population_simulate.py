"""Stage: one shard of the simulations over a population."""

from __future__ import annotations

import logging
from pathlib import Path

from swesbi.artefacts import save
from swesbi.population.dataset import KIND, to_dataset
from swesbi.population.settings import PopulationSettings
from swesbi.population.simulations import simulate_population
from swesbi.settings import Settings
from swesbi.speed_model.model import SpeedModelSettings
from swesbi.stages.origin import Origin

LOGGER = logging.getLogger("swesbi")


class PopulationSimulateStageSettings(Settings):
    """What a shard depends on."""

    contexts: tuple[int, int]
    draws_per_context: int
    phases: int
    population: PopulationSettings
    model: SpeedModelSettings


def run(*, shard: Path, settings: PopulationSimulateStageSettings, origin: Origin) -> None:
    """Simulate the contexts numbered from the first to before the second of ``settings.contexts``.

    Raises:
        SimulationFailure: A draw failed too often.
        ValueError: The reference beat of a context does not become periodic.
    """
    made = simulate_population(
        range(*settings.contexts),
        settings.draws_per_context,
        settings.population,
        settings.phases,
        settings.model,
        origin.seed,
        f"simulations {shard.parent.parent.name} {shard.stem}",
    )
    save(shard, to_dataset(made), origin.provenance(KIND, settings))
    failed, drawn = int(made.failures.sum()), made.theta.shape[0] * made.theta.shape[1]
    LOGGER.info("%d contexts, %d simulations, %d failed and drawn again", len(made.contexts), drawn, failed)
