"""Well-specified recordings of fresh hearts, and what the tests look at in each: the nulls of the verdict.

They are made once for a model, its prior, a population and the conditions of recording, and come with the
package. A study under other settings makes its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Final

from swesbi import artefacts
from swesbi.artefacts.schema import Schema
from swesbi.base.arrays import below_each_other
from swesbi.base.progress import Progress
from swesbi.context import Context
from swesbi.draws import resampled_rows
from swesbi.measurement.likelihood import SpeedModel, predict_draws
from swesbi.networks.flow.trained import TrainedFlow, flow_proposal
from swesbi.population.recordings import (
    MODEL_NOISE,
    FreshSettings,
    fresh_subject,
    record_fresh,
    record_pushes,
    recorded,
)
from swesbi.population.settings import NullSettings
from swesbi.posterior.exact import weighted_posterior
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.settings import ExactSettings
from swesbi.recording.observation import context_values, contexts_of
from swesbi.seeds import generator, integer_seed
from swesbi.verdict.nulls import STRIP_LABELS, Misfits, misfits_of

GATED_STREAM: Final = "population null"
PUSHES_STREAM: Final = "null pushes"
ALONG: Final = "recording"
PUSHES: Final = "pushes"
"""The group of free-running null recordings; gated ones are at the root."""


@dataclass(frozen=True)
class NullRecordings(artefacts.Artefact, kind="population_null"):
    """Well-specified recordings, and what the tests look at in each; contexts are of gated ones."""

    contexts: tuple[Context, ...]
    gated: Annotated[Misfits, artefacts.Part()]
    pushes: Annotated[Misfits, artefacts.Part(group=PUSHES)]

    @classmethod
    def schema(cls) -> Schema:
        """Return groups and datasets of the file."""
        own = artefacts.schema_of(cls)
        return {**own, "/": artefacts.schema_of(Context, ALONG)["/"] | own["/"]}

    @classmethod
    def required_labels(cls) -> tuple[artefacts.Labels, ...]:
        """Return the labels of strips, and names of the recordings."""
        return (*map(artefacts.Labels, STRIP_LABELS), artefacts.Labels(ALONG, "subject"))

    def to_groups(self) -> dict[str, artefacts.Group]:
        """Return the content of the file, gated recordings at the root."""
        schema, values = self.schema(), artefacts.values_of(self)
        values["/"] |= context_values(self.contexts)
        names = {
            "/": [context.subject for context in self.contexts],
            PUSHES: [str(number) for number in range(len(self.pushes))],
        }
        return {
            group: artefacts.build_group(
                schema[group], values[group], {"subject": (ALONG, names[group])} | STRIP_LABELS
            )
            for group in schema
        }

    @classmethod
    def rebuilt(cls, groups: Mapping[str, artefacts.Group], made: artefacts.Provenance) -> NullRecordings:
        """Return what the groups of a file hold."""
        return artefacts.from_groups(cls, groups, {"contexts": contexts_of(groups["/"], ALONG)})


def null_recordings(
    estimator: TrainedFlow,
    *,
    fresh: FreshSettings,
    null_sizes: NullSettings,
    exact: ExactSettings,
    seed: int,
) -> NullRecordings:
    """Make and infer null recordings of both kinds, with the study's own settings of the exact posterior."""

    def gated(number: int) -> SpeedModel:
        subject = fresh_subject(number, fresh, seed, GATED_STREAM)
        return recorded(subject, record_fresh(subject, MODEL_NOISE, fresh, seed, GATED_STREAM))

    def pushes(number: int) -> SpeedModel:
        return record_pushes(number, fresh.conditions.free_running.pushes, fresh, seed, PUSHES_STREAM)[0]

    def checked(
        made: Callable[[int], SpeedModel], count: int, stream: str
    ) -> tuple[tuple[Context, ...], Misfits]:
        progress = Progress(f"{stream} recordings", count, unit="recording")
        contexts, found = [], []
        for number in range(count):
            model = made(number)
            of_recording = integer_seed(seed, stream, number)
            contexts.append(model.recording.context)
            found.append(infer_checks(model, estimator, null_sizes.effective_draws, exact, of_recording))
            progress.step()
        return tuple(contexts), below_each_other(found)

    contexts, of_phases = checked(gated, null_sizes.recordings, GATED_STREAM)
    _, of_pushes = checked(pushes, null_sizes.free_running_recordings, PUSHES_STREAM)
    return NullRecordings(contexts, of_phases, of_pushes)


def infer_checks(
    model: SpeedModel, flow: TrainedFlow, effective_draws: int, exact: ExactSettings, seed: int
) -> Misfits:
    """Infer one recording by so many effective draws, and return what the tests look at in it."""
    proposal = flow_proposal(flow, model.recording)
    drawn, _ = weighted_posterior(HeartModel(model), proposal, effective_draws, exact, seed)
    rng = generator(seed, "residuals")
    predicted = predict_draws(model, drawn.phi[resampled_rows(drawn.weight, effective_draws, rng)])
    return misfits_of(model, drawn.phi, drawn.weight, predicted, rng)
