"""What the page is made of: the study's tables, verdicts and recordings, read once."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import pandas as pd

from swesbi.recording.observation import Observation
from swesbi.verdict.verdict import NOT_CONTRADICTED, PRIOR_SUPPORTED, Verdict

PASSED: Final = frozenset({NOT_CONTRADICTED, PRIOR_SUPPORTED})


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
        verdicts: Verdict of each subject.
        scores: Its rows of ``ppc.csv``.
        features: Its rows of ``features.csv``.
        posterior: Its rows of ``posterior.csv``.
        recovery: What its credible intervals cover.
        training: ``training.csv``.
    """

    name: str
    settings: Mapping[str, Any]
    verdicts: Mapping[str, Verdict]
    scores: pd.DataFrame
    features: pd.DataFrame
    posterior: pd.DataFrame
    recovery: Recovery
    training: pd.DataFrame

    @property
    def passed(self) -> pd.DataFrame:
        """The scores of subjects not contradicted, or prior-supported; strained ones are left out."""
        known = {name for name, verdict in self.verdicts.items() if verdict.status in PASSED}
        return self.scores[self.scores["may_be_read"] & self.scores["subject"].isin(known)]

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
