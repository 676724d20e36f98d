"""Calibration as files: of one subject, of a cohort, and on fresh contexts of a population."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Annotated, Final

from swesbi.artefacts import Artefact, Group, Part, Provenance, build_group, from_groups, schema_of, to_groups
from swesbi.artefacts.schema import Labels, Schema
from swesbi.artefacts.stored import labels_of
from swesbi.base.arrays import below_each_other
from swesbi.checks.calibration.fresh import FreshRecordings
from swesbi.checks.calibration.ranks import InferredRecordings, RankedRecordings, TwoSamples
from swesbi.context import Context
from swesbi.recording.observation import context_values, contexts_of
from swesbi.verdict.misfits import STRIP_LABELS

ALONG: Final = "recording"
OF_CONTEXTS: Final = schema_of(Context, ALONG)["/"]
REFUSED: Final = "refused"


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
    def of(
        cls, recordings: Sequence[CalibrationRecordings], local_parts: Sequence[CalibrationLocal]
    ) -> Calibration:
        """Put the parts of all subjects together, in the order given."""
        return cls(
            model_noise=below_each_other([part.model_noise for part in recordings]),
            sample_by_sample=below_each_other([part.sample_by_sample for part in recordings]),
            local=below_each_other([part.local for part in local_parts]),
            two_samples=TwoSamples.joined([part.two_samples for part in local_parts]),
        )


@dataclass(frozen=True)
class PopulationCalibration(Artefact, kind="population_calibration"):
    """Recordings of fresh contexts: under the model's own noise, and acquired sample by sample."""

    model_noise: FreshRecordings
    sample_by_sample: FreshRecordings

    @classmethod
    def schema(cls) -> Schema:
        """Return groups and datasets of the file."""
        return {field.name: schema_of(FreshRecordings)["/"] | OF_CONTEXTS for field in fields(cls)}

    @classmethod
    def required_labels(cls) -> tuple[Labels, ...]:
        """Return the labels of quantities and strips, and the names of the contexts."""
        return (*map(Labels, STRIP_LABELS), *labels_of(FreshRecordings))

    def to_groups(self) -> dict[str, Group]:
        """Return the content of the file."""
        return {field.name: _fresh_dataset(getattr(self, field.name)) for field in fields(self)}

    @classmethod
    def rebuilt(cls, groups: Mapping[str, Group], made: Provenance) -> PopulationCalibration:
        """Return what the groups of a file hold."""
        return cls(**{name: _fresh_of(group) for name, group in groups.items()})

    @classmethod
    def joined(cls, parts: Sequence[PopulationCalibration]) -> PopulationCalibration:
        """Return the parts together, in the order given."""
        own, acquired = [part.model_noise for part in parts], [part.sample_by_sample for part in parts]
        return cls(FreshRecordings.joined(own), FreshRecordings.joined(acquired))


def _fresh_dataset(fresh: FreshRecordings) -> Group:
    contexts = build_group(OF_CONTEXTS, context_values(fresh.contexts))
    inferred = to_groups(fresh, STRIP_LABELS)["/"]
    return replace(inferred.joined(contexts), attrs={REFUSED: fresh.refused})


def _fresh_of(dataset: Group) -> FreshRecordings:
    given = {"contexts": contexts_of(dataset, ALONG), "refused": int(dataset.attrs[REFUSED])}
    return from_groups(FreshRecordings, {"/": dataset}, given)
