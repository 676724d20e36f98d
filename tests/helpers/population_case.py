"""The shipped experiment over a population, in sizes for tests."""

from __future__ import annotations

from functools import cache

import speed_case

from swesbi.config.experiments import PopulationExperimentSettings
from swesbi.networks.flow.conditioning import CellSettings
from swesbi.networks.flow.training import TrainedWithLosses
from swesbi.population.recordings import FreshSettings
from swesbi.population.simulations import PopulationSimulations, shard_of_population
from swesbi.population.training import RowMaker, train_population

CONFIG = speed_case.shipped()
EXPERIMENT: PopulationExperimentSettings = CONFIG.population_experiments["amortised"]
MODEL = speed_case.model().settings
CELLS = CellSettings(cells=20, relative_se=EXPERIMENT.conditions.seen_relative_se)
FRESH = FreshSettings(
    population=EXPERIMENT.population,
    conditions=EXPERIMENT.conditions,
    acquisition=CONFIG.acquisition,
    recording=CONFIG.recording,
    model=MODEL,
)
TINY = EXPERIMENT.estimator.model_copy(
    update={"transforms": 2, "hidden_features": 24, "hidden_layers": 1, "epochs": 4, "batch_size": 64}
)


def maker(prior: str = "paper") -> RowMaker:
    model = speed_case.settings(prior)
    return RowMaker(model, EXPERIMENT.conditions, CONFIG.acquisition, CONFIG.recording, CELLS, seed=3)


MAKER = maker()


def shard(first: int, stop: int, draws: int, prior: str = "paper") -> PopulationSimulations:
    return shard_of_population(
        context_numbers=(first, stop),
        draws_per_context=draws,
        phases=20,
        population=EXPERIMENT.population,
        model=speed_case.settings(prior),
        experiment="amortised",
        seed=5,
    )


@cache
def made(contexts: int = 60, draws: int = 20, prior: str = "paper") -> PopulationSimulations:
    return shard(0, contexts, draws, prior)


@cache
def trained() -> TrainedWithLosses:
    return train_population(made(), MAKER, TINY)
