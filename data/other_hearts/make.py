"""Make the hearts of the letters e, f and p; README.md beside it says what they are.

    python data/other_hearts/make.py f data/other_hearts/land2017.h5
    python data/other_hearts/make.py e data/other_hearts/physioblocks.h5 --physioblocks PYTHON
    python data/other_hearts/make.py p data/other_hearts/emulated.h5

PYTHON is that of an environment with `physioblocks==2.0.1`. From the folder of `config.yaml`, with its seed.
Hearts that the file has already stay as they are, and those that it lacks are drawn; without it, all are.
"""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final

sys.path.insert(0, str(Path(__file__).parents[2]))  # the project's folder, where `data` is found

from data.other_hearts.drawn import People, Source, draw_heart
from data.other_hearts.emulated import EmulatedHearts
from data.other_hearts.land_population import LandHearts
from data.other_hearts.physioblocks import PhysioBlocksHearts, Program
from studies.validation.hearts.stored import HeartsOfLetter, StoredHeart, Stream
from swesbi.artefacts import Provenance
from swesbi.config.models import Config
from swesbi.config.read import parse_config, read_merged
from swesbi.parameters import THETA_NAMES

LOGGER = logging.getLogger("swesbi")
COUNTS: Final[dict[str, dict[Stream, int]]] = {
    "e": {"exam": 60, "development": 10, "filling": 60},
    "f": {"exam": 60, "development": 10},
    "p": {"filling": 600},
}
SCRIPT: Final = Path("data/other_hearts/program/physioblocks_hearts.py")
PRIOR: Final = "calibrated"
POPULATION: Final = "amortised"


def source_of(letter: str, config: Config, physioblocks: str | None, stack: ExitStack) -> Source:
    """Return where the hearts of a letter come from; the stack ends the program that may run for them."""
    if letter == "f":
        return LandHearts(config.forward_model)
    if letter == "p":
        return EmulatedHearts(config.priors[PRIOR])
    if physioblocks is None:
        raise SystemExit("letter e needs --physioblocks PYTHON, of an environment with physioblocks==2.0.1")
    program = stack.enter_context(Program([physioblocks, str(SCRIPT)]))
    return PhysioBlocksHearts(config.priors[PRIOR], program)


def without_nuisances(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return what hearts depend on: of a prior, that of theta."""
    prior = {name: settings["prior"][name] for name in THETA_NAMES if "prior" in settings}
    return {**settings, "prior": prior}


def people_of(config: Config) -> People:
    """Return the population, and how well the verdict on its subjects takes LVESV to be measured."""
    misspecification = config.speed_experiments[config.base_of(POPULATION)].misspecification
    population = config.population_experiments[POPULATION].population
    return People(population, misspecification.rule.volumes.lvesv_tolerance_fraction)


def all_hearts(source: Source, people: People, seed: int, kept: Sequence[StoredHeart]) -> list[StoredHeart]:
    """Return the hearts of a source, stream by stream: those that are there, else drawn."""
    there = {(heart.stream, heart.number): heart for heart in kept}
    hearts = []
    for stream, count in COUNTS[source.letter].items():
        for number in range(count):
            heart = there.get((stream, number)) or draw_heart(source, stream, number, people, seed)
            LOGGER.info(
                "%s %s %d: ejection fraction %.2f",
                source.letter,
                stream,
                number,
                heart.beat.ejection_fraction,
            )
            hearts.append(heart)
    return hearts


def kept_hearts(path: Path, made: Provenance) -> Sequence[StoredHeart]:
    """Return the hearts of a file, none where there is no file; another seed or settings are refused."""
    if not path.exists():
        return []
    kept = HeartsOfLetter.read(path)
    there = kept.made.seed, without_nuisances(kept.made.settings)
    if there != (made.seed, without_nuisances(made.settings)):
        raise SystemExit(f"{path}: its hearts are of another seed or of other settings; give another path")
    return kept.hearts


def main() -> None:
    """Draw the hearts of a letter and store them."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("letter", choices=tuple(COUNTS))
    parser.add_argument("path", type=Path)
    parser.add_argument("--physioblocks", metavar="PYTHON")
    parser.add_argument("--config", type=Path, default=Path("config.yaml"))
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    config = parse_config(read_merged(arguments.config), str(arguments.config))
    people = people_of(config)
    with ExitStack() as stack:
        source = source_of(arguments.letter, config, arguments.physioblocks, stack)
        settings = {
            "letter": source.letter,
            "population": people.population.to_plain(),
            "lvesv_fraction": people.lvesv_fraction,
            **source.settings,
        }
        made = Provenance("", seed=config.seed, settings=settings)
        hearts = all_hearts(source, people, config.seed, kept_hearts(arguments.path, made))
    HeartsOfLetter(hearts, made).write(arguments.path, made)


if __name__ == "__main__":
    main()
