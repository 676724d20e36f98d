"""Make the stored hearts of the letters e and f anew; README.md beside it says what they are.

    python data/other_hearts/make.py f data/other_hearts/land2017.h5
    python data/other_hearts/make.py e data/other_hearts/physioblocks.h5 --physioblocks PYTHON

PYTHON is that of an environment with `physioblocks==2.0.1`. From the folder of `config.yaml`, with its seed.
"""

from __future__ import annotations

import argparse
import logging
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Final

sys.path.insert(0, str(Path(__file__).parents[2]))  # the project's folder, where `data` is found

from data.other_hearts.drawn import People, Source, draw_hearts
from data.other_hearts.land_population import LandHearts
from data.other_hearts.physioblocks import PhysioBlocksHearts, Program
from swesbi.config.models import Config
from swesbi.config.read import parse_config, read_merged
from swesbi.virtual.hearts.stored import Stream, save_hearts

COUNTS: Final[dict[Stream, int]] = {"exam": 60, "development": 10}
SCRIPT: Final = Path("benchmarks/physioblocks_hearts.py")
PRIOR: Final = "calibrated"
POPULATION: Final = "amortised"


def source_of(letter: str, config: Config, physioblocks: str | None, stack: ExitStack) -> Source:
    """Return where the hearts of a letter come from; the stack ends the program that may run for them.

    Raises:
        SystemExit: Letter e without a Python that has physioblocks.
    """
    if letter == "f":
        return LandHearts(config.forward_model)
    if physioblocks is None:
        raise SystemExit("letter e needs --physioblocks PYTHON, of an environment with physioblocks==2.0.1")
    program = stack.enter_context(Program([physioblocks, str(SCRIPT)]))
    return PhysioBlocksHearts(config.priors[PRIOR], program)


def people_of(config: Config) -> People:
    """Return the population, and how well the verdict on its subjects takes LVESV to be measured."""
    misspecification = config.speed_experiments[config.base_of(POPULATION)].misspecification
    population = config.population_experiments[POPULATION].population
    return People(population, misspecification.rule.volumes.lvesv_tolerance_fraction)


def main() -> None:
    """Draw the hearts of a letter and store them."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("letter", choices=("e", "f"))
    parser.add_argument("path", type=Path)
    parser.add_argument("--physioblocks", metavar="PYTHON")
    parser.add_argument("--config", type=Path, default=Path("config.yaml"))
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    config = parse_config(read_merged(arguments.config), str(arguments.config))
    people = people_of(config)
    with ExitStack() as stack:
        source = source_of(arguments.letter, config, arguments.physioblocks, stack)
        hearts = [
            heart
            for stream, count in COUNTS.items()
            for heart in draw_hearts(source, stream, count, people, config.seed)
        ]
        settings = {
            "letter": source.letter,
            "population": people.population.to_plain(),
            "lvesv_fraction": people.lvesv_fraction,
            **source.settings,
        }
    save_hearts(hearts, arguments.path, config.seed, settings)


if __name__ == "__main__":
    main()
