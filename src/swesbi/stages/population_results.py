"""Reading what the landing page shows of experiments over a population."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from pydantic import JsonValue

from swesbi.artefacts import ArtefactError
from swesbi.population.cohort import read_cohort
from swesbi.show.figures.population import read_strata
from swesbi.show.tables.population import OverPopulation


def read_populations(
    sections: Mapping[str, Mapping[str, JsonValue]], cohorts: Sequence[Path], strata: Sequence[Path]
) -> tuple[OverPopulation, ...]:
    """Read the experiments over a population, in the order of their sections.

    Args:
        sections: Of the configuration, by experiment, with the mass of the credible intervals.
        cohorts: ``cohort.csv`` of every experiment, in its folder.
        strata: ``strata.csv`` likewise.

    Raises:
        ArtefactError: A file of an experiment is missing, or not what its name says.
    """
    files = {"cohort": cohorts, "strata": strata}
    by_kind = {kind: {path.parent.name: path for path in paths} for kind, paths in files.items()}
    for name in sections:
        if missing := [kind for kind, paths in by_kind.items() if name not in paths]:
            raise ArtefactError(f"experiment {name!r}: no file of {', '.join(missing)} is given")
    return tuple(
        OverPopulation(
            name=name,
            settings=plain,
            interval=float(str(plain["interval"])),
            cohort=read_cohort(by_kind["cohort"][name]),
            strata=read_strata(by_kind["strata"][name]),
        )
        for name, plain in sections.items()
    )
