"""Reading what the landing page shows of experiments on speeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from swesbi.artefacts import ArtefactError
from swesbi.evaluation.exact_result import read_exact_result
from swesbi.noise.dataset import read_noise
from swesbi.show.results import Experiment
from swesbi.show.tables.exact import Exact
from swesbi.stages.places import by_place


def read_exact(
    experiments: Sequence[Experiment],
    posteriors: Sequence[Path],
    tables: Mapping[str, Sequence[Path]],
    noise: Sequence[Path],
    truth: Sequence[Path],
) -> tuple[Exact, ...]:
    """Read what only experiments on speeds have, in the order of the experiments.

    Args:
        experiments: All experiments.
        posteriors: ``posterior.h5`` of every subject in every experiment on speeds.
        tables: By kind, ``<kind>.csv`` of every experiment on speeds.
        noise: The cohort's noise; none without an experiment on speeds.
        truth: ``truth.csv``, or none.

    Raises:
        ArtefactError: A file of an experiment is missing.
    """
    chosen = [experiment for experiment in experiments if experiment.exact]
    if chosen and not noise:
        raise ArtefactError("the cohort's noise is not given")
    truths = _truth(truth)
    found = by_place(posteriors)
    return tuple(
        Exact(
            experiment=experiment,
            results={
                place.subject: read_exact_result(path)
                for place, path in found.items()
                if place.experiment == experiment.name
            },
            noise=read_noise(noise[0]),
            truth=truths[truths["experiment"] == experiment.name],
            **{kind: _table(paths, kind, experiment.name) for kind, paths in tables.items()},
        )
        for experiment in chosen
    )


def _table(paths: Sequence[Path], kind: str, experiment: str) -> pd.DataFrame:
    by_experiment = {path.parent.name: path for path in paths}
    if experiment not in by_experiment:
        raise ArtefactError(f"experiment {experiment!r}: no file of {kind} is given")
    return pd.read_csv(by_experiment[experiment], converters={"subject": str})


def _truth(paths: Sequence[Path]) -> pd.DataFrame:
    if not paths:
        return pd.DataFrame(columns=["experiment"])
    return pd.read_csv(paths[0], converters={"experiment": str, "subject": str})
