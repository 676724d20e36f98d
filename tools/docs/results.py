"""The results of a finished study that the documentation shows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from data.makers.files import read_true_theta
from swesbi.artefacts import ArtefactError
from swesbi.config.study import Study
from swesbi.report.figures.training import read_epochs, read_history
from swesbi.report.results import Experiment, Recovery
from swesbi.report.tables.experiments import read_comparison
from swesbi.verdict.verdict import Verdict, read_verdict


@dataclass(frozen=True)
class ReproductionResults:
    """Results of the experiments on features.

    Attributes:
        main: The main experiment.
        experiments: All that were run, the main one among them.
        subjects: Names of the main experiment's subjects.
        cohort_title: What the subjects are ("virtual volunteers").
        comparison: ``tables/paper_comparison.csv``, as text.
        epochs: ``epochs.csv`` of the main experiment.
        true_theta: True theta (3,) of each subject; empty where the cohort has none.
    """

    main: Experiment
    experiments: tuple[Experiment, ...]
    subjects: tuple[str, ...]
    cohort_title: str
    comparison: pd.DataFrame
    epochs: pd.DataFrame
    true_theta: Mapping[str, NDArray[np.float64]]

    @property
    def verdicts(self) -> Mapping[str, Verdict]:
        """Support of each subject under the main experiment."""
        return self.main.verdicts

    @property
    def supported(self) -> tuple[str, ...]:
        """The subjects that the main experiment's prior supports."""
        return tuple(name for name in self.subjects if self.verdicts[name].may_be_read)


def read_results(folder: Path, study: Study, docs: Path) -> ReproductionResults:
    """Read what the documentation shows.

    Raises:
        ArtefactError: The study is not finished: a file is missing.
    """
    config, truth = study.config, study.cohort / "truth.csv"
    names = [name for name in config.experiments_run if name in config.feature_experiments]
    with finished():
        experiments = tuple(read_experiment(folder, study, name, docs) for name in names)
        return ReproductionResults(
            main=next(each for each in experiments if each.name == config.main_experiment),
            experiments=experiments,
            subjects=study.subjects_of(config.main_experiment),
            cohort_title=config.cohort_title,
            comparison=read_comparison(folder / "tables" / "paper_comparison.csv"),
            epochs=read_epochs(folder / config.main_experiment / "epochs.csv"),
            true_theta=read_true_theta(truth) if truth.is_file() else {},
        )


def at_length(folder: Path, docs: Path, experiment: str, table: str) -> Path:
    """Return a table of calibration as ``make full`` stored it, or else the study's own."""
    stored = docs / "tables" / f"{experiment}_{table}.csv"
    return stored if stored.is_file() else folder / experiment / f"{table}.csv"


def read_experiment(folder: Path, study: Study, name: str, docs: Path) -> Experiment:
    """Read what every experiment has from the folder of a study's results.

    Args:
        folder: Results of the study.
        study: Configuration and cohort.
        name: The experiment.
        docs: Folder of the documentation, which may hold its recovery from a longer run.

    Raises:
        FileNotFoundError: A file is missing.
    """
    own, tables = folder / name, folder / "tables"
    section = {**study.config.feature_experiments, **study.config.speed_experiments}[name]
    kinds = ("recovery", "recovery_acquisition")
    recoveries = (read_table(at_length(folder, docs, name, kind)) for kind in kinds)
    return Experiment(
        name=name,
        settings=section.model_dump(mode="json"),
        verdicts={s: read_verdict(own / "subjects" / s / "verdict.json") for s in study.subjects_of(name)},
        scores=of_experiment(tables / "ppc.csv", name),
        features=of_experiment(tables / "features.csv", name),
        posterior=of_experiment(tables / "posterior.csv", name),
        recovery=Recovery(*recoveries),
        training=read_history(own / "training.csv"),
    )


def of_experiment(path: Path, name: str) -> pd.DataFrame:
    """Return an experiment's rows of a table of the study."""
    table = read_table(path)
    return table[table["experiment"] == name]


def read_table(path: Path) -> pd.DataFrame:
    """Read a table in which subjects and experiments are names, whatever they look like."""
    return pd.read_csv(path, converters={"subject": str, "experiment": str})


@contextmanager
def finished() -> Iterator[None]:
    """Say of a missing file that the study is not finished.

    Raises:
        ArtefactError: A file does not exist.
    """
    try:
        yield
    except (FileNotFoundError, ArtefactError) as error:
        cause = error.__cause__ if isinstance(error, ArtefactError) else error
        if not isinstance(cause, FileNotFoundError):
            raise
        raise ArtefactError(
            f"{cause.filename} does not exist: finish the study first (make study)"
        ) from error
