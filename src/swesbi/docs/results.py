"""The results of a finished study that the documentation shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.artefacts import ArtefactError
from swesbi.config import Study
from swesbi.figures.epochs import read_epochs
from swesbi.figures.training import read_history
from swesbi.inference.support import Support, read_support
from swesbi.virtual_cohort.record import read_true_theta


@dataclass(frozen=True)
class Results:
    """Tables of a finished study.

    Attributes:
        main: Name of the main experiment.
        experiments: Names of the experiments on features that were run.
        subjects: Names of the subjects.
        cohort_title: What the subjects are ("virtual volunteers").
        scores: Their rows of ``tables/ppc.csv``.
        posterior: Their rows of ``tables/posterior.csv``.
        comparison: ``tables/paper_comparison.csv``, as text.
        recovery: ``recovery.csv`` of each experiment.
        recovery_acquisition: ``recovery_acquisition.csv`` of each experiment.
        training: ``training.csv`` of each experiment.
        epochs: ``epochs.csv`` of the main experiment.
        supports: Support of each subject under the main experiment.
        true_theta: True theta (3,) of each subject; empty where the cohort has none.
    """

    main: str
    experiments: tuple[str, ...]
    subjects: tuple[str, ...]
    cohort_title: str
    scores: pd.DataFrame
    posterior: pd.DataFrame
    comparison: pd.DataFrame
    recovery: Mapping[str, pd.DataFrame]
    recovery_acquisition: Mapping[str, pd.DataFrame]
    training: Mapping[str, pd.DataFrame]
    epochs: pd.DataFrame
    supports: Mapping[str, Support]
    true_theta: Mapping[str, NDArray[np.float64]]

    @property
    def supported(self) -> tuple[str, ...]:
        """The subjects that the main experiment's prior supports."""
        return tuple(name for name in self.subjects if self.supports[name].supported)


def read_results(folder: Path, study: Study) -> Results:
    """Read what the documentation shows.

    Raises:
        ArtefactError: The study is not finished: a file is missing.
    """
    config = study.config
    main = config.main_experiment
    experiments = tuple(name for name in config.experiments_run if name in config.feature_experiments)
    try:
        return Results(
            main=main,
            experiments=experiments,
            subjects=study.subjects,
            cohort_title=config.cohort_title,
            scores=_of_experiments(folder / "tables" / "ppc.csv", experiments),
            posterior=_of_experiments(folder / "tables" / "posterior.csv", experiments),
            comparison=pd.read_csv(
                folder / "tables" / "paper_comparison.csv", dtype=str, keep_default_na=False
            ),
            recovery=_of_each(folder, experiments, "recovery.csv"),
            recovery_acquisition=_of_each(folder, experiments, "recovery_acquisition.csv"),
            training={name: read_history(folder / name / "training.csv") for name in experiments},
            epochs=read_epochs(folder / main / "epochs.csv"),
            supports={
                name: read_support(folder / main / "subjects" / name / "support.json")
                for name in study.subjects
            },
            true_theta=_true_theta(study.cohort / "truth.csv"),
        )
    except FileNotFoundError as error:
        raise ArtefactError(
            f"{error.filename} does not exist: finish the study first (make study)"
        ) from error


def _of_experiments(path: Path, experiments: tuple[str, ...]) -> pd.DataFrame:
    table = pd.read_csv(path, dtype={"subject": str})
    return table[table["experiment"].isin(experiments)]


def _of_each(folder: Path, experiments: tuple[str, ...], name: str) -> dict[str, pd.DataFrame]:
    return {experiment: pd.read_csv(folder / experiment / name) for experiment in experiments}


def _true_theta(path: Path) -> dict[str, NDArray[np.float64]]:
    return read_true_theta(path) if path.is_file() else {}
