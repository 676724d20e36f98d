"""All generators by letter, those of development among them; a further one has an entry here."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from studies.validation.hearts.hearts import SimulatedHearts, simulated_generators
from studies.validation.hearts.stored import StoredHearts, stored_generators
from swesbi.population.settings import PopulationSettings
from swesbi.prior import PriorSettings
from swesbi.recording.settings import AcquisitionSettings

Generator = SimulatedHearts | StoredHearts
"""Where the hearts of one letter come from: it has a letter, a title, an acquisition, and draws a heart."""
STORED: Final = Path("data/other_hearts")
"""Where the hearts lie that other programs and other laws made; README.md there says how."""


def all_generators(
    population: PopulationSettings,
    prior: PriorSettings,
    acquisition: AcquisitionSettings,
    lvesv_fraction: float,
) -> Mapping[str, Generator]:
    """Return every generator by its letter; arguments as of ``simulated_generators``."""
    return {
        **simulated_generators(population, prior, acquisition, lvesv_fraction),
        **stored_generators(STORED, acquisition),
    }


def generator_of(generators: Mapping[str, Generator], letter: str) -> Generator:
    """Return the generator of a letter."""
    if letter not in generators:
        there = ", ".join(sorted(generators))
        raise ValueError(
            f"no generator {letter!r}; those of other hearts: {there}; 'g' is one where the "
            "prior of the experiment has `nuisances.speed_scale`"
        )
    return generators[letter]
