"""All generators of the exam by letter, and those of development; a further one has an entry here."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from swesbi.exam.heart import Generator
from swesbi.exam.hearts import simulated_generators
from swesbi.exam.settings import MadeSettings
from swesbi.exam.stored import stored_generators
from swesbi.population.settings import PopulationSettings
from swesbi.prior import PriorSettings
from swesbi.virtual_cohort.settings import AcquisitionSettings

STORED: Final = Path("data/exam")
"""Where the hearts lie that other programs and other laws made; README.md there says how."""


def all_generators(
    settings: MadeSettings,
    population: PopulationSettings,
    prior: PriorSettings,
    acquisition: AcquisitionSettings,
    lvesv_fraction: float,
) -> Mapping[str, Generator]:
    """Return every generator by its letter; arguments as of ``simulated_generators``."""
    return {
        **simulated_generators(settings, population, prior, acquisition, lvesv_fraction),
        **stored_generators(STORED, acquisition),
    }


def generator_of(generators: Mapping[str, Generator], letter: str) -> Generator:
    """Return the generator of a letter.

    Raises:
        ValueError: There is none.
    """
    if letter not in generators:
        there = ", ".join(sorted(generators))
        raise ValueError(
            f"no generator {letter!r}; those of the exam and of development: {there}; 'g' is one where the "
            "prior of the experiment has `nuisances.speed_scale`"
        )
    return generators[letter]
