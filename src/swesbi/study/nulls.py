"""Which null recordings an experiment is judged among: those of the package, or its own study's."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

from swesbi.artefacts.files import hdf5_provenance
from swesbi.config.read import ConfigError
from swesbi.config.study import Study
from swesbi.config.view import View
from swesbi.verdict.settings import SHIPPED_NULLS


def nulls_of(study: Study, experiment: str) -> Path:
    """Return the null recordings of an experiment on speeds or over a population.

    They are those that come with the package where these are of the same model: equations, prior, discrepancy
    and operator. Else the study makes its own, by the network of a population with that model.
    """
    model = View(study, {"experiment": experiment})["model"]
    if json.dumps(model, sort_keys=True) == _shipped_model():
        return SHIPPED_NULLS
    populations = study.config.population_experiments
    by = [name for name, one in populations.items() if experiment in (name, one.base)]
    if not by:
        raise ConfigError(
            f"experiment {experiment}: its verdicts need null recordings, and those of the package are of "
            "another prior or forward model; add a population experiment with "
            f"`base: {experiment}`, whose network makes them"
        )
    return Path(study.config.networks or study.config.results) / by[0] / "null.h5"


@cache
def _shipped_model() -> str:
    """Return the model of the null recordings of the package, as the text of its settings."""
    return json.dumps(hdf5_provenance(SHIPPED_NULLS).settings["fresh"]["model"], sort_keys=True)
