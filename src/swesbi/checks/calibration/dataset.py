"""Calibration as files: of one subject, of a cohort, and on fresh contexts of a population."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Annotated, Final, Self

import numpy as np
import pandas as pd

from swesbi import artefacts
from swesbi.artefacts import Artefact, Group, Labels, Part, Provenance, Variable, schema_of
from swesbi.artefacts.schema import Schema
from swesbi.base.arrays import BoolArray, FloatArray, below_each_other
from swesbi.checks.calibration.ranks import RankedRecordings
from swesbi.context import Context
from swesbi.recording.observation import context_values, contexts_of
from swesbi.verdict.nulls import STRIP_LABELS, Misfits

ALONG: Final = "recording"
OF_CONTEXTS: Final = schema_of(Context, ALONG)["/"]
REFUSED: Final = "refused"


@dataclass(frozen=True)
class Diagnostics:
    """What the exact posteriors of n recordings leave beside their scores."""

    k_hat: Annotated[FloatArray, Variable("recording", "1", "Pareto shape of the importance weights")]
    efficiency: Annotated[FloatArray, Variable("recording", "1", "effective share of the weighted draws")]
    log_evidence: Annotated[
        FloatArray, Variable("recording", "1", "log evidence of the log speeds, from the weights")
    ]
    by_mcmc: Annotated[BoolArray, Variable("recording", "1", "1 where MCMC took over from the weights")]

    def __str__(self) -> str:
        """Say how the exact posteriors were drawn."""
        return (
            f"efficiency {np.median(self.efficiency):.0%} (median), k-hat at most {self.k_hat.max():.2f}, "
            f"MCMC took over in {int(self.by_mcmc.sum())} of {len(self.by_mcmc)}"
        )


@dataclass(frozen=True)
class InferredRecordings:
    """Recordings with scores, what else their exact posteriors say, and what the verdict sees."""

    ranked: Annotated[RankedRecordings, Part()]
    diagnostics: Annotated[Diagnostics, Part()]
    misfits: Annotated[Misfits, Part()]


@dataclass(frozen=True)
class TwoSamples:
    """Whether a classifier tells two samplers apart, by subject and pair of them, each joined by a space."""

    subject: Annotated[tuple[str, ...], Labels("subject")]
    pair: Annotated[tuple[str, ...], Labels("pair")]
    accuracy: Annotated[
        FloatArray, Variable("subject pair", "1", "accuracy of a classifier between two samplers")
    ]
    draws: Annotated[FloatArray, Variable("subject pair", "1", "draws of each sampler; NaN: not compared")]

    @classmethod
    def joined(cls, parts: Sequence[TwoSamples]) -> TwoSamples:
        """Return those of several subjects, in the order given; NaN for a pair that one has not.

        Pairs are in the order of their names where not all have the same.
        """
        pairs = parts[0].pair
        if any(part.pair != pairs for part in parts):
            pairs = tuple(sorted({pair for part in parts for pair in part.pair}))

        def of_all(name: str) -> FloatArray:
            tables = [pd.DataFrame(getattr(part, name), columns=list(part.pair)) for part in parts]
            return pd.concat(tables).reindex(columns=list(pairs)).to_numpy()

        subjects = tuple(subject for part in parts for subject in part.subject)
        return cls(subjects, pairs, of_all("accuracy"), of_all("draws"))


@dataclass(frozen=True)
class CalibrationRecordings(Artefact, kind="calibration_recordings"):
    """Recordings of known parameters: under the model's own noise, and acquired sample by sample."""

    model_noise: Annotated[InferredRecordings, Part(group="model_noise")]
    sample_by_sample: Annotated[InferredRecordings, Part(group="sample_by_sample")]

    labels = STRIP_LABELS


@dataclass(frozen=True)
class CalibrationLocal(Artefact, kind="calibration_local"):
    """Calibration at subjects' own data, and their samplers beside each other."""

    local: Annotated[RankedRecordings, Part(group="local")]
    two_samples: Annotated[TwoSamples, Part(group="two_samples")]


@dataclass(frozen=True)
class Calibration(CalibrationLocal, CalibrationRecordings, kind="calibration"):
    """All of it over a cohort."""

    @classmethod
    def of(cls, recordings: Sequence[CalibrationRecordings], local: Sequence[CalibrationLocal]) -> Self:
        """Put the parts of all subjects together, in the order given."""
        return cls(
            model_noise=below_each_other([part.model_noise for part in recordings]),
            sample_by_sample=below_each_other([part.sample_by_sample for part in recordings]),
            local=below_each_other([part.local for part in local]),
            two_samples=TwoSamples.joined([part.two_samples for part in local]),
        )


@dataclass(frozen=True)
class FreshRecordings:
    """n recordings of known parameters with their contexts and what was inferred; ``refused`` count apart.

    ``relative_se`` is NaN for pushes, each of which has an error of its own.
    """

    contexts: tuple[Context, ...]
    relative_se: Annotated[
        FloatArray,
        Variable(
            "recording", "1", "standard error of the mean speed of a phase without failed samples, over it"
        ),
    ]
    inferred: Annotated[InferredRecordings, Part()]
    refused: int

    @classmethod
    def joined(cls, parts: Sequence[FreshRecordings]) -> FreshRecordings:
        """Return several, in the order given."""
        return replace(
            below_each_other(parts),
            contexts=tuple(context for part in parts for context in part.contexts),
            refused=sum(part.refused for part in parts),
        )


@dataclass(frozen=True)
class _OfFresh(Artefact):
    """A file with fresh recordings of one or more kinds, a group each."""

    @classmethod
    def schema(cls) -> Schema:
        """Return groups and datasets of the file."""
        return {field.name: schema_of(FreshRecordings)["/"] | OF_CONTEXTS for field in fields(cls)}

    @classmethod
    def required_labels(cls) -> tuple[Labels, ...]:
        """Return the labels of quantities and strips, and the names of the contexts."""
        return (*map(Labels, STRIP_LABELS), *artefacts.labels_of(FreshRecordings))

    def to_groups(self) -> dict[str, Group]:
        """Return the content of the file."""
        return {field.name: _fresh_dataset(getattr(self, field.name)) for field in fields(self)}

    @classmethod
    def rebuilt(cls, groups: Mapping[str, Group], made: Provenance) -> Self:
        """Return what the groups of a file hold."""
        return cls(**{name: _fresh_of(group) for name, group in groups.items()})

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Return the parts together, in the order given."""
        return cls(
            **{
                field.name: FreshRecordings.joined([getattr(part, field.name) for part in parts])
                for field in fields(cls)
            }
        )


@dataclass(frozen=True)
class PopulationCalibration(_OfFresh, kind="population_calibration"):
    """Recordings of fresh contexts: under the model's own noise, and acquired sample by sample."""

    model_noise: FreshRecordings
    sample_by_sample: FreshRecordings


@dataclass(frozen=True)
class PushesCalibration(_OfFresh, kind="pushes_calibration"):
    """Free-running recordings of fresh contexts, of several numbers of pushes."""

    pushes: FreshRecordings


def _fresh_dataset(fresh: FreshRecordings) -> Group:
    contexts = artefacts.build_group(OF_CONTEXTS, context_values(fresh.contexts))
    inferred = artefacts.to_groups(fresh, STRIP_LABELS)["/"]
    return replace(inferred.joined(contexts), attrs={REFUSED: fresh.refused})


def _fresh_of(dataset: Group) -> FreshRecordings:
    given = {"contexts": contexts_of(dataset, ALONG), "refused": int(dataset.attrs[REFUSED])}
    return artefacts.from_groups(FreshRecordings, {"/": dataset}, given)
