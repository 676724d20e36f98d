"""What the page is made of: the study's tables, verdicts and recordings, read once."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from swesbi.recording.observation import Observation
from swesbi.verdict.answers import SUPPORTED, status
from swesbi.verdict.support import Support


@dataclass(frozen=True)
class Recovery:
    """Coverages of one experiment on synthetic recordings, as the columns of ``recovery.csv``.

    Attributes:
        own: Noise of the experiment's own observation model.
        acquisition: Acquisition noise, passed through the whole pipeline.
    """

    own: pd.DataFrame
    acquisition: pd.DataFrame


@dataclass(frozen=True)
class Experiment:
    """What is shown of one experiment.

    Attributes:
        name: Its name in the configuration.
        settings: Its section of the configuration, plain; the prior as the prior itself.
        supports: Verdict of each subject.
        scores: Its rows of ``ppc.csv``.
        features: Its rows of ``features.csv``.
        posterior: Its rows of ``posterior.csv``.
        recovery: What its credible intervals cover.
        training: ``training.csv``.
    """

    name: str
    settings: Mapping[str, Any]
    supports: Mapping[str, Support]
    scores: pd.DataFrame
    features: pd.DataFrame
    posterior: pd.DataFrame
    recovery: Recovery
    training: pd.DataFrame

    @property
    def supported(self) -> pd.DataFrame:
        """The scores of the subjects that are supported; strained ones are left out."""
        known = {name for name, support in self.supports.items() if status(support) == SUPPORTED}
        return self.scores[self.scores["supported"] & self.scores["subject"].isin(known)]

    @property
    def credible_percent(self) -> float:
        """Mass of the credible intervals, in percent."""
        part = "exact" if self.exact else "posterior"
        return 100.0 * float(self.settings[part]["interval"])

    @property
    def exact(self) -> bool:
        """Whether the likelihood is explicit: an experiment with noise on the measured speeds."""
        return "exact" in self.settings

    @property
    def predictive_percent(self) -> float:
        """Mass of the predictive intervals, in percent."""
        return 100.0 * float(self.settings["predictive"]["interval"])


@dataclass(frozen=True)
class Results:
    """The whole study; ``main`` is the experiment whose figures 2 and 3 are shown."""

    observations: tuple[Observation, ...]
    experiments: tuple[Experiment, ...]
    main: Experiment
    comparison: pd.DataFrame


def records(table: pd.DataFrame) -> list[dict[Hashable, Any]]:
    """Return a table's rows by column name."""
    return table.to_dict("records")


def is_true(value: object) -> bool:
    """Tell whether a cell of a table read from CSV says so: a column with gaps holds texts, others truths."""
    return str(value) == "True"
