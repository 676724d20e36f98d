"""What the page is made of: the study's tables, verdicts and recordings, read once."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import pandas as pd

from swesbi.posterior.result import ExactPosterior
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.report.table import DOUBTFUL as WITH_CARE
from swesbi.report.table import MARK, MUTED
from swesbi.verdict.summary import LIMITS, REFUSED
from swesbi.verdict.verdict import Status, Verdict

PASSED: Final = (Status.NOT_CONTRADICTED, Status.PRIOR_SUPPORTED)
NOT_READ: Final = (Status.CONTRADICTED, Status.NOT_PRIOR_SUPPORTED, REFUSED)
MARKS: Final = {Status.DOUBTFUL: WITH_CARE} | dict.fromkeys(NOT_READ, MUTED)
"""How a subject's row is set: grey where the posterior must not be used, amber where it needs care."""


def no_rows() -> pd.DataFrame:
    """Return a table of experiments without any row."""
    return pd.DataFrame({"experiment": []}, dtype=str)


@dataclass(frozen=True)
class Experiment:
    """What is shown of one experiment: its rows of the tables of the study, by their names.

    Settings are plain, but for the prior. ``recovery`` has the noise of the experiment's own observation
    model, ``recovery_acquisition`` that of recordings passed through the whole pipeline. From ``results``
    on, fields are of experiments on speeds alone; ``truth`` is empty for a cohort without known truth.
    """

    name: str
    settings: Mapping[str, Any]
    verdicts: Mapping[str, Verdict]
    scores: pd.DataFrame
    features: pd.DataFrame
    posterior: pd.DataFrame
    recovery: pd.DataFrame
    recovery_acquisition: pd.DataFrame
    training: pd.DataFrame
    results: Mapping[str, ExactPosterior] = field(default_factory=dict)
    calibration: pd.DataFrame = field(default_factory=no_rows)
    alarms: pd.DataFrame = field(default_factory=no_rows)
    identifiability: pd.DataFrame = field(default_factory=no_rows)
    truth: pd.DataFrame = field(default_factory=no_rows)
    noise: CohortNoise | None = None

    @property
    def passed(self) -> pd.DataFrame:
        """The scores of subjects not contradicted, or prior-supported; doubtful ones are left out."""
        known = {name for name, verdict in self.verdicts.items() if verdict.status in PASSED}
        return self.scores[self.scores["may_be_read"] & self.scores["subject"].isin(known)]

    def at_level(self, recovery: pd.DataFrame) -> pd.DataFrame:
        """Return a recovery at the nominal level of the credible intervals, by parameter.

        Where the study has not scored that level, the one next to it is taken; the tables name it.
        """
        apart = (recovery["nominal"] - self.credible_percent / 100.0).abs()
        nearest = recovery["nominal"].iloc[int(apart.argmin())]
        rows: pd.DataFrame = recovery[recovery["nominal"] == nearest].set_index("parameter")
        return rows

    @property
    def status(self) -> pd.Series:
        """Verdict of each subject in one word."""
        return pd.Series({name: verdict.status for name, verdict in self.verdicts.items()}, dtype=object)

    def marked(self, table: pd.DataFrame) -> pd.DataFrame:
        """Return a table with a column of subjects, each row marked by the subject's verdict."""
        return marked(table, table["subject"].map(self.status))

    @property
    def credible_percent(self) -> float:
        """Mass of the credible intervals, in percent."""
        part = "exact" if self.exact else "posterior"
        return 100.0 * float(self.settings[part]["interval"])

    @property
    def intervals(self) -> str:
        """What a note says of the mass of credible intervals."""
        return f"Intervals: {self.credible_percent:g} %."

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
    statements: pd.DataFrame


def records(table: pd.DataFrame) -> list[dict[Hashable, Any]]:
    """Return a table's rows by column name."""
    return table.to_dict("records")


def marked(table: pd.DataFrame, statuses: pd.Series) -> pd.DataFrame:
    """Return a table with each row marked by a verdict."""
    return table.assign(**{MARK: statuses.map(MARKS).fillna("")})


def wide(table: pd.DataFrame, rows: Sequence[str], by: str) -> pd.DataFrame:
    """Return a row for each value of ``rows``, in their order.

    A column "{value of by}_{column}" has what the table has of each value; the other columns are those of
    the first row of each.
    """
    return pd.DataFrame(
        {**found[0], **{f"{row[by]}_{name}": value for row in found for name, value in row.items()}}
        for found in (records(part) for _, part in table.groupby(list(rows), sort=False))
    )


def columns_of(prefix: str, names: Iterable[str] = LIMITS) -> tuple[str, ...]:
    """Return columns of :func:`wide`: "k0_kpa" as "k0_kpa_median", "k0_kpa_low", "k0_kpa_high"."""
    return tuple(f"{prefix}_{name}" for name in names)
