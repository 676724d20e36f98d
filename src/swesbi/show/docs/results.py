"""What the page on an experiment on speeds shows of a finished study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.artefacts import ArtefactError
from swesbi.config import Study
from swesbi.config.models import SpeedExperimentSettings
from swesbi.evaluation.exact_result import ExactResult, read_exact_result
from swesbi.inference.support import Support, read_support
from swesbi.noise.cohort import CohortNoise
from swesbi.noise.dataset import read_noise
from swesbi.show.figures.training import read_epochs, read_history
from swesbi.virtual_cohort import read_true_theta


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


REFERENCE: Final = Path("tests/reference/study")
"""Tables of studies of their own, which take longer than the study: committed, not made anew."""


@dataclass(frozen=True)
class CalibrationResults:
    """Results of one experiment on speeds.

    Attributes:
        name: Its name.
        settings: Its section of the configuration.
        subjects: Names of the subjects.
        cohort_title: What the subjects are ("virtual volunteers").
        noise: The cohort's noise.
        training: ``training.csv``.
        supports: Verdict of each subject.
        exact: Exact posterior of each subject.
        scores: Its rows of ``tables/ppc.csv``.
        derived: Its rows of ``tables/posterior.csv``.
        recovery: ``recovery.csv``.
        recovery_acquisition: ``recovery_acquisition.csv``.
        calibration: ``calibration.csv``.
        misspecification: ``misspecification.csv``.
        identifiability: ``identifiability.csv``.
        design: ``design.csv``.
        truth: Its rows of ``tables/truth.csv``; None where the cohort has no known truth.
        discrepancy: The study of the discrepancy; None before ``make discrepancy``.
        sensitivity: The study of other choices; None before ``make sensitivity``.
        flow_choice: The study of architectures; None before ``benchmarks/flow_choice.py``.
    """

    name: str
    settings: SpeedExperimentSettings
    subjects: tuple[str, ...]
    cohort_title: str
    noise: CohortNoise
    training: pd.DataFrame
    supports: Mapping[str, Support]
    exact: Mapping[str, ExactResult]
    scores: pd.DataFrame
    derived: pd.DataFrame
    recovery: pd.DataFrame
    recovery_acquisition: pd.DataFrame
    calibration: pd.DataFrame
    misspecification: pd.DataFrame
    identifiability: pd.DataFrame
    design: pd.DataFrame
    truth: pd.DataFrame | None
    discrepancy: pd.DataFrame | None
    sensitivity: pd.DataFrame | None
    flow_choice: pd.DataFrame | None


def experiment_shown(study: Study) -> str | None:
    """Return the experiment on speeds that the page shows, the first that is run; None if none is."""
    names = (name for name in study.config.experiments_run if name in study.config.speed_experiments)
    return next(names, None)


def read_calibration_results(folder: Path, study: Study, name: str, docs: Path) -> CalibrationResults:
    """Read what the page shows.

    Args:
        folder: Results of the study.
        study: Configuration and cohort.
        name: The experiment.
        docs: Folder of the documentation, which holds tables of its own.

    Raises:
        ArtefactError: The study is not finished: a file is missing.
    """
    own = folder / name
    try:
        return CalibrationResults(
            name=name,
            settings=study.config.speed_experiments[name],
            subjects=study.subjects,
            cohort_title=study.config.cohort_title,
            noise=read_noise(folder / "cohort" / "noise.h5"),
            training=read_history(own / "training.csv"),
            supports={s: read_support(own / "subjects" / s / "support.json") for s in study.subjects},
            exact={s: read_exact_result(own / "subjects" / s / "posterior.h5") for s in study.subjects},
            scores=_of(_read(folder / "tables" / "ppc.csv"), name),
            derived=_of(_read(folder / "tables" / "posterior.csv"), name),
            recovery=_read(own / "recovery.csv"),
            recovery_acquisition=_read(own / "recovery_acquisition.csv"),
            calibration=_read(own / "calibration.csv"),
            misspecification=_read(own / "misspecification.csv"),
            identifiability=_read(own / "identifiability.csv"),
            design=_read(own / "design.csv"),
            truth=_truth(folder, study, name),
            discrepancy=_if_there(REFERENCE / "discrepancy.csv"),
            sensitivity=_if_there(REFERENCE / "sensitivity.csv"),
            flow_choice=_if_there(docs / "tables" / "flow_choice.csv"),
        )
    except FileNotFoundError as error:
        raise ArtefactError(
            f"{error.filename} does not exist: finish the study first (make study)"
        ) from error


def _truth(folder: Path, study: Study, name: str) -> pd.DataFrame | None:
    if not (study.cohort / "truth.csv").is_file():
        return None
    return _of(_read(folder / "tables" / "truth.csv"), name)


def _read(path: Path) -> pd.DataFrame:
    return pd.read_csv(path, converters={"subject": str, "experiment": str})


def _of(table: pd.DataFrame, experiment: str) -> pd.DataFrame:
    return table[table["experiment"] == experiment]


def _if_there(path: Path) -> pd.DataFrame | None:
    return _read(path) if path.is_file() else None
