"""What the comparison with the paper reads of a finished study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from swesbi.evaluation.fit import CmaesFit
from swesbi.inference.pool import Pool
from swesbi.inference.support import Support
from swesbi.recording.observation import Observation


@dataclass(frozen=True)
class PoolSize:
    """The size of a training pool: its subjects, features, rows, and prior simulations of each subject."""

    subjects: tuple[str, ...]
    features: tuple[str, ...]
    rows: int
    simulations: tuple[int, ...]


@dataclass(frozen=True)
class StudyResults:
    """Tables and artefacts of a study.

    Attributes:
        cohort_title: What the subjects are ("virtual volunteers").
        main: The experiment that stands for the paper's.
        settings: Plain settings: ``experiment`` (the main one, its prior as such), ``cmaes``, ``recording``.
        protocol: How the cohort was recorded, as its ``recording.yaml`` says.
        ppc: The predictive scores of every experiment and subject.
        posterior: Medians, intervals and correlations of every experiment and subject.
        features: The checked features of every experiment and subject.
        supports: Verdicts of the main experiment, by subject, in the cohort's order.
        recoveries: Recovery scores by experiment.
        training: Losses of the main experiment, one row an epoch.
        pool: Size of the main experiment's pool.
        observations: The recordings.
        fits: CMA-ES fits by subject.
    """

    cohort_title: str
    main: str
    settings: Mapping[str, Any]
    protocol: Mapping[str, Any]
    ppc: pd.DataFrame
    posterior: pd.DataFrame
    features: pd.DataFrame
    supports: Mapping[str, Support]
    recoveries: Mapping[str, pd.DataFrame]
    training: pd.DataFrame
    pool: PoolSize
    observations: Sequence[Observation]
    fits: Mapping[str, CmaesFit]

    def scores(self, experiment: str = "", supported: bool = True) -> pd.DataFrame:
        """Return the scores of one experiment (the main one), by subject; of the supported ones alone."""
        table = self.ppc[self.ppc["experiment"] == (experiment or self.main)].set_index("subject")
        return table[table["supported"].astype(bool)] if supported else table

    def parameter(self, name: str, experiment: str = "") -> pd.DataFrame:
        """Return the posterior of one parameter in one experiment, by supported subject."""
        table = self.posterior
        chosen = (table["experiment"] == (experiment or self.main)) & (table["parameter"] == name)
        return table[chosen & table["supported"].astype(bool)].set_index("subject")


def pool_size(pool: Pool) -> PoolSize:
    """Count a pool."""
    drawn = np.unique(np.stack([pool.subject_index, pool.draw_index]), axis=1)
    counts = np.bincount(drawn[0], minlength=len(pool.subjects))
    return PoolSize(pool.subjects, pool.components.features, len(pool.z), tuple(map(int, counts)))
