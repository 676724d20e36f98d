"""Well-specified recordings of fresh hearts, and what the tests look at in each: the nulls of the verdict.

They are made once for a model, its prior, a population and the conditions of recording, and come with the
package. A study under other settings makes its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import xarray as xr

from swesbi import artefacts
from swesbi.base.arrays import below_each_other
from swesbi.base.progress import Progress
from swesbi.context import Context
from swesbi.draws import resampled_rows
from swesbi.measurement.likelihood import SpeedModel
from swesbi.networks.flow.flow import TrainedFlow, flow_proposal
from swesbi.population.recordings import (
    OWN,
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
from swesbi.verdict.checks import STRIP_LABELS, Checks, check_recording

GATED_STREAM: Final = "population null"
PUSHES_STREAM: Final = "null pushes"
ALONG: Final = "recording"
PUSHES: Final = "pushes"
"""The group of free-running null recordings; gated ones are at the root."""


@dataclass(frozen=True)
class NullRecordings:
    """Well-specified recordings of fresh contexts, and what the tests look at in each.

    Attributes:
        contexts: Of n gated recordings.
        gated: What the tests look at in these.
        pushes: The same of m free-running recordings.
    """

    contexts: tuple[Context, ...]
    gated: Annotated[Checks, artefacts.Part()]
    pushes: Annotated[Checks, artefacts.Part(group=PUSHES)]


def draw_nulls(
    flow: TrainedFlow, fresh: FreshSettings, sizes: NullSettings, exact: ExactSettings, seed: int
) -> NullRecordings:
    """Make and infer null recordings of both kinds.

    Args:
        flow: The trained network.
        fresh: Where recordings come from.
        sizes: How many of each kind, and their effective draws.
        exact: The study's own settings of the exact posterior.
        seed: The study's seed.
    """

    def gated(number: int) -> SpeedModel:
        subject = fresh_subject(number, fresh, seed, GATED_STREAM)
        return recorded(subject, record_fresh(subject, OWN, fresh, seed, GATED_STREAM))

    def pushes(number: int) -> SpeedModel:
        asked = fresh.conditions.free_running.pushes
        return record_pushes(number, asked, fresh, seed, PUSHES_STREAM)[0]

    def checked(
        made: Callable[[int], SpeedModel], count: int, stream: str
    ) -> tuple[tuple[Context, ...], Checks]:
        progress = Progress(f"{stream} recordings", count, unit="recording")
        contexts, found = [], []
        for number in range(count):
            model = made(number)
            of_recording = integer_seed(seed, stream, number)
            contexts.append(model.recording.context)
            found.append(infer_checks(model, flow, sizes.effective_draws, exact, of_recording))
            progress.step()
        return tuple(contexts), below_each_other(found)

    contexts, of_phases = checked(gated, sizes.recordings, GATED_STREAM)
    _, of_pushes = checked(pushes, sizes.free_running_recordings, PUSHES_STREAM)
    return NullRecordings(contexts, of_phases, of_pushes)


def infer_checks(
    model: SpeedModel, flow: TrainedFlow, effective_draws: int, exact: ExactSettings, seed: int
) -> Checks:
    """Infer one recording by so many effective draws, and return what the tests look at in it."""
    proposal = flow_proposal(flow, model.recording)
    drawn, _ = weighted_posterior(HeartModel(model), proposal, effective_draws, exact, seed)
    rng = generator(seed, "residuals")
    predicted = model.predict(drawn.phi[resampled_rows(drawn.weight, effective_draws, rng)])
    return check_recording(model, drawn.phi, drawn.weight, predicted, rng)


SCHEMA: Final = artefacts.schema_of(NullRecordings)
ROOT: Final = artefacts.schema_of(Context, ALONG)["/"] | SCHEMA["/"]
KIND: Final = artefacts.register(
    "population_null", {**SCHEMA, "/": ROOT}, (*STRIP_LABELS, artefacts.Labels(ALONG, "subject"))
)


def null_groups(null: NullRecordings) -> dict[str, xr.Dataset]:
    """Return the null recordings, gated ones at the root, as datasets with dimension recording."""
    values = artefacts.values_of(null)
    names = {"subject": (ALONG, [context.subject for context in null.contexts])}
    root = artefacts.build_dataset(ROOT, values["/"] | context_values(null.contexts), names | STRIP_LABELS)
    numbers = {"subject": (ALONG, [str(number) for number in range(len(null.pushes))])}
    pushes = artefacts.build_dataset(SCHEMA[PUSHES], values[PUSHES], numbers | STRIP_LABELS)
    return {"/": root, PUSHES: pushes}


def read_nulls(path: Path) -> NullRecordings:
    """Read the null recordings with the contexts of the gated ones.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    groups = {group: artefacts.load(path, KIND, group)[0] for group in SCHEMA}
    return artefacts.from_groups(NullRecordings, groups, {"contexts": contexts_of(groups["/"], ALONG)})
