"""The study of identifiability as an artefact and as tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pandas as pd

from swesbi.artefacts import (
    Artefact,
    Group,
    Labels,
    Provenance,
    Variable,
    arranged,
    build_group,
    schema_of,
    stacked_values,
    values_of,
)
from swesbi.artefacts.schema import Schema
from swesbi.base.arrays import FloatArray
from swesbi.checks.identifiability.designs import Placement
from swesbi.checks.identifiability.information import QUANTITY_NAMES, interval_fold
from swesbi.checks.identifiability.settings import IdentifiabilitySettings
from swesbi.checks.identifiability.subject import (
    CohortIdentifiability,
    RecordedSubject,
    SubjectIdentifiability,
)
from swesbi.parameters import PHI_COLUMNS, PHI_NAMES

if TYPE_CHECKING:
    import xarray as xr

BY_PHASE: Final = "subject quantity phase"
OF_SUBJECTS: Final = schema_of(SubjectIdentifiability, along="subject")
ADDED: Final = {
    "/": {
        "interval_mass": Variable("", "1", "mass of credible, level of likelihood-ratio intervals"),
        "shown_phi": Variable("subject draw parameter", PHI_COLUMNS, "posterior draws for the figure"),
    },
    "profile": {
        "activation_duration_s": Variable(
            "subject", "s", "duration D_T of the activation (posterior median)", after="log_likelihood"
        ),
        "confidence_level": Variable("level", "1", "levels that are marked"),
    },
    "phases": {
        "phase_of": Variable("subject phase", "1", "phase, fraction of the cycle from the R peak"),
        "measured": Variable("subject phase", "1", "1 where measured; the rest is NaN elsewhere"),
        "share": Variable(BY_PHASE, "1", "share in the expected information, all else known"),
        "expected_sd_increase": Variable(BY_PHASE, "1", "expected relative growth of the sd without it"),
        "left_out_sd_increase": Variable(BY_PHASE, "1", "the same of the draws, reweighted"),
        "left_out_mean_shift": Variable(BY_PHASE, "1", "change of the mean log without it, in sd"),
        "k_hat": Variable("subject phase", "1", "Pareto k of the weights; reliable below 0.7"),
    },
    "design": {
        "repeat_se": Variable("subject", "1", "relative standard error of one repeat's mean speed"),
        "own_repeats": Variable("subject", "1", "repeats of the recording, equivalent"),
        "own_phases": Variable("subject", "1", "measured phases of the recording"),
    },
}
"""What has to be put together from subjects, recordings and settings."""
SCHEMA: Final = {group: arranged(OF_SUBJECTS.get(group, {}) | ADDED[group]) for group in ADDED} | schema_of(
    Placement
)
PLACEMENTS: Final = ("even", "chosen")


OF_PHASES: Final = {
    "share": "phases.share",
    "expected_sd_increase": "phases.sd_increase",
    "left_out_sd_increase": "left_out.sd_increase",
    "left_out_mean_shift": "left_out.mean_shift",
    "k_hat": "left_out.k_hat",
}
"""Where what is told of each measured phase lies in what was found of a subject."""


@dataclass(frozen=True)
class Identifiability(Artefact, kind="identifiability"):
    """The study of a cohort, by group of its file."""

    groups: Mapping[str, Group]

    @property
    def datasets(self) -> dict[str, xr.Dataset]:
        """The groups as datasets, for tables and figures."""
        return {name: group.to_xarray() for name, group in self.groups.items()}

    @classmethod
    def schema(cls) -> Schema:
        """Return groups and datasets of the file."""
        return SCHEMA

    @classmethod
    def required_labels(cls) -> tuple[Labels, ...]:
        """Return the text labels of the file."""
        return tuple(map(Labels, ("subject", "quantity", "parameter", "bound")))

    def to_groups(self) -> Mapping[str, Group]:
        """Return the content of the file."""
        return self.groups

    @classmethod
    def rebuilt(cls, groups: Mapping[str, Group], made: Provenance) -> Identifiability:
        """Return what the groups of a file hold."""
        return cls(groups)

    @classmethod
    def of(cls, cohort: CohortIdentifiability, settings: IdentifiabilitySettings) -> Identifiability:
        """Put together what was found of a cohort."""
        values = stacked_values(cohort.subjects) | values_of(cohort.placement)
        added, labels = _added(cohort, settings), _labels(cohort, settings)
        return cls(
            {
                group: build_group(variables, values.get(group, {}) | added.get(group, {}), labels)
                for group, variables in SCHEMA.items()
            }
        )


def _added(cohort: CohortIdentifiability, settings: IdentifiabilitySettings) -> dict[str, dict[str, Any]]:
    """Return the values of ``ADDED``."""
    recorded, subjects = cohort.recorded, cohort.subjects
    fewest = min(len(subject.shown) for subject in subjects)
    pairs = list(zip(recorded, subjects, strict=True))
    return {
        "/": {
            "interval_mass": settings.interval,
            "shown_phi": np.stack([subject.shown[:fewest] for subject in subjects]),
        },
        "profile": {
            "activation_duration_s": np.array([subject.duration_s for subject in recorded]),
            "confidence_level": list(settings.profile.confidence_levels),
        },
        "phases": {
            "phase_of": np.stack([subject.phase for subject in recorded]),
            "measured": np.stack([subject.measured for subject in recorded]).astype(np.int8),
            **{
                name: np.stack([_with_missing(one, attrgetter(path)(found)) for one, found in pairs])
                for name, path in OF_PHASES.items()
            },
        },
        "design": {
            "repeat_se": np.sqrt([subject.repeat.total for subject in recorded]),
            "own_repeats": np.array([subject.equivalent_repeats for subject in recorded]),
            "own_phases": np.array([int(subject.measured.sum()) for subject in recorded]),
        },
    }


def _labels(cohort: CohortIdentifiability, settings: IdentifiabilitySettings) -> dict[str, Any]:
    return {
        "subject": [subject.subject for subject in cohort.subjects],
        "quantity": list(QUANTITY_NAMES),
        "parameter": list(PHI_NAMES),
        "bound": ["lower", "upper"],
        "phases": list(settings.design.phases),
        "repeats": list(settings.design.repeats),
        "placed": list(cohort.placement.counts),
    }


def _with_missing(recorded: RecordedSubject, values: FloatArray) -> FloatArray:
    """Spread values (..., p) of the measured phases over all phases (..., P), NaN where missing."""
    spread = np.full((*values.shape[:-1], len(recorded.measured)), np.nan)
    spread[..., recorded.measured] = values
    return spread


def summary_table(root: xr.Dataset, profile: xr.Dataset) -> pd.DataFrame:
    """Return one row a subject and quantity: contraction, spread found and expected, likelihood interval.

    The isometric stiffness is no parameter: its likelihood columns are empty.
    """
    names = ["median", "sd_log", "contraction", "contraction_log", "expected_sd_log"]
    table = root[names].to_dataframe().reset_index()
    table["expected_over_found"] = table["expected_sd_log"] / table["sd_log"]
    keys = ["subject", "quantity"]
    likelihood = profile["maximum_phi"].to_dataframe(name="maximum_likelihood")
    for bound, column in (("lower", "likelihood_low"), ("upper", "likelihood_high")):
        likelihood[column] = profile["interval"].sel(bound=bound, drop=True).to_dataframe(name=column)
        open_end = profile["closed"].sel(bound=bound, drop=True).to_dataframe(name="closed") == 0
        likelihood[f"{column}_open"] = open_end
    likelihood = likelihood.reset_index().rename(columns={"parameter": "quantity"})
    return table[keys + [name for name in table if name not in keys]].merge(likelihood, "left", on=keys)


def information_table(phases: xr.Dataset) -> pd.DataFrame:
    """Return one row a subject, quantity and measured phase: what it tells, and the posterior without it."""
    table = phases.to_dataframe().reset_index().rename(columns={"phase": "position", "phase_of": "phase"})
    table = table[table["measured"] == 1].sort_values(["subject", "quantity", "position"], kind="stable")
    columns = ["share", "expected_sd_increase", "left_out_sd_increase", "left_out_mean_shift", "k_hat"]
    return table[["subject", "quantity", "position", "phase", *columns]].reset_index(drop=True)


def design_table(design: xr.Dataset, placement: xr.Dataset, mass: float) -> pd.DataFrame:
    """Return one row a subject, quantity and design; ``repeats`` is "inf" for the discrepancy's floor.

    ``fold`` is the upper over the lower end of the expected credible interval. ``model_errors`` says
    whether those of near phases are correlated or all are independent. Chosen phases are compared at the
    repeats of the recordings themselves.
    """
    parts = [
        _evenly(design, sd, floor).assign(model_errors=errors)
        for sd, floor, errors in (
            ("sd_log", "floor", "correlated"),
            ("sd_log_independent", "floor_independent", "independent"),
        )
    ]
    table = pd.concat([*parts, _placed(design, placement)], ignore_index=True)
    table["fold"] = interval_fold(table["sd_log"].to_numpy(), mass)
    order = ["subject", "quantity", "placement", "model_errors", "phases", "repeats", "sd_log", "fold"]
    return table[order].sort_values(order[:6], kind="stable").reset_index(drop=True)


def _evenly(design: xr.Dataset, sd: str, floor: str) -> pd.DataFrame:
    rows = design[sd].to_dataframe(name="sd_log").reset_index()
    without_noise = design[floor].to_dataframe(name="sd_log").reset_index().assign(repeats=np.inf)
    return pd.concat([rows, without_noise], ignore_index=True).assign(placement=PLACEMENTS[0])


def _placed(design: xr.Dataset, placement: xr.Dataset) -> pd.DataFrame:
    rows = placement["sd_log"].to_dataframe(name="sd_log").reset_index().rename(columns={"placed": "phases"})
    repeats = design["own_repeats"].to_series().rename("repeats")
    return rows.join(repeats, on="subject").assign(placement=PLACEMENTS[1], model_errors="correlated")
