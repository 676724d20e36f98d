"""The recordings whose tests make nulls and power, and what the tests looked at, as an artefact."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import xarray as xr

from swesbi import artefacts
from swesbi.base.arrays import FloatArray, below_each_other
from swesbi.base.progress import Progress
from swesbi.draws import resampled_rows
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import SpeedRecording, measured_speeds
from swesbi.networks.flow.conditioning import ConditioningSettings
from swesbi.networks.flow.flow import TrainedFlow, flow_proposal
from swesbi.posterior.exact import weighted_posterior
from swesbi.posterior.settings import ExactSettings
from swesbi.recording.ingest import ingest
from swesbi.recording.problems import RecordingError
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.seeds import generator, integer_seed
from swesbi.verdict import statistics
from swesbi.verdict.nulls import Reference, fit_reference
from swesbi.verdict.settings import RuleSettings, SyntheticSettings
from swesbi.virtual.volunteers import Volunteer, record, simulate_truth

LOGGER = logging.getLogger("swesbi")
NULL: Final = "null"
OWN: Final = "own"
ACQUIRED: Final = "acquired"
VOLUNTEER: Final = "volunteer"
KINDS: Final = (NULL, OWN, ACQUIRED, VOLUNTEER)
"""Recordings of a subject: two well-specified sets under the model's own noise, of which the first makes
the null; one recorded sample by sample; the virtual volunteer recorded anew."""
LABELS: Final[dict[str, Any]] = {"bounded": list(statistics.WITH_STRIPS), "bound": list(statistics.BOUNDS)}
SEEN: Final = artefacts.Part(words={"features": "features S(.) as the network sees them", "bound": " there"})
RECORDED: Final = SEEN.place_all(artefacts.schema_of(statistics.Checks)["/"])


def posterior_draws(
    model: SpeedModel, flow: TrainedFlow, effective_draws: int, exact: ExactSettings, seed: int
) -> statistics.PosteriorDraws:
    """Infer the model's recording by so many effective draws, and predict from as many equal ones."""
    drawn, _ = weighted_posterior(model, flow_proposal(flow, model.recording), effective_draws, exact, seed)
    rows = resampled_rows(drawn.weight, effective_draws, generator(seed, "predicted"))
    return statistics.PosteriorDraws(
        drawn.phi, drawn.weight, model.predict(drawn.phi[rows]), drawn.k_hat, drawn.efficiency
    )


def check_recordings(
    model: SpeedModel,
    recordings: Sequence[SpeedRecording],
    flow: TrainedFlow,
    conditioning: ConditioningSettings,
    settings: SyntheticSettings,
    exact: ExactSettings,
    seed: int,
    name: str,
) -> statistics.Checks:
    """Infer recordings of one subject and return what the tests look at in each; n rows.

    Args:
        model: The subject's model; its passive shape depends on the context alone.
        recordings: The n recordings, at least one.
        flow: The proposal.
        conditioning: How speeds become the features that the tests look at.
        settings: Effective draws of each recording, and the width of the strip at a bound.
        exact: The study's own settings of the exact posterior.
        seed: Study seed; each recording has a stream of its own.
        name: Names the streams and the progress lines.
    """
    progress = Progress(f"{model.recording.subject}, {name} recordings", len(recordings), unit="recording")
    rows = []
    for index, recording in enumerate(recordings):
        stream = ("misspecification", name, model.recording.subject, index)
        own = replace(model, recording=recording)
        of_recording = integer_seed(seed, *stream)
        posterior = posterior_draws(own, flow, settings.effective_draws, exact, of_recording)
        rng = generator(seed, *stream, "replicated")
        rows.append(statistics.check_recording(own, posterior, conditioning, settings.strip_fraction, rng))
        progress.step()
    return below_each_other(rows)


def volunteer_recordings(
    volunteer: Volunteer,
    count: int,
    settings: RecordingSettings,
    grid_points: int,
    noise: NoiseComponents,
    seed: int,
) -> tuple[tuple[SpeedRecording, ...], int]:
    """Record a volunteer ``count`` times with other acquisition noise, each time ingested anew.

    Returns:
        The recordings, and how many ingestion refused.
    """
    truth = simulate_truth(volunteer)
    kept = []
    for index in range(count):
        samples = record(truth, integer_seed(seed, "misspecification", "volunteer", index))
        try:
            observed = ingest(samples, volunteer.context, settings, grid_points)
        except RecordingError as error:
            LOGGER.info("volunteer %s, recording %d refused: %s", volunteer.context.subject, index, error)
        else:
            kept.append(measured_speeds(observed, noise))
    return tuple(kept), count - len(kept)


@dataclass(frozen=True)
class SubjectChecks:
    """What the tests look at in all synthetic recordings of one subject.

    Attributes:
        subject: Its name.
        recordings: The checks of each kind of recording; those of the volunteer may be none.
        refused: Recordings of each kind that ingestion refused.
    """

    subject: str
    reference_features: Annotated[
        FloatArray,
        artefacts.Variable("reference feature", statistics.FEATURE_UNITS, "prior predictive features"),
    ]
    feature_names: Annotated[tuple[str, ...], artefacts.Labels("feature")]
    prior_mass: Annotated[
        FloatArray,
        artefacts.Variable("bounded bound", "1", "prior mass in the strip there", "prior_strip_mass"),
    ]
    recordings: Mapping[str, statistics.Checks]
    refused: Mapping[str, int]

    def reference(self, settings: RuleSettings) -> Reference:
        """Fit the null distributions."""
        null = self.recordings[NULL]
        return fit_reference(null, self.reference_features, self.feature_names, self.prior_mass, settings)


ROOT: Final = artefacts.schema_of(SubjectChecks)["/"] | {
    "refused": artefacts.Variable("kind_of_recording", "1", "recordings that ingestion refused")
}
KIND: Final = artefacts.register(
    "misspecification",
    {"/": ROOT, **dict.fromkeys(KINDS, RECORDED)},
    (*LABELS, *artefacts.labels_of(SubjectChecks), "kind_of_recording"),
)


def to_groups(checks: SubjectChecks) -> dict[str, xr.Dataset]:
    """Return the groups of ``misspecification.h5``."""
    values = artefacts.values_of(checks)["/"] | {
        "refused": np.array([checks.refused[kind] for kind in KINDS])
    }
    labels = {**LABELS, "feature": list(checks.feature_names), "kind_of_recording": list(KINDS)}
    of_kind = {
        kind: artefacts.build_dataset(RECORDED, artefacts.values_of(checks.recordings[kind])["/"], labels)
        for kind in KINDS
    }
    return {"/": artefacts.build_dataset(ROOT, values, labels), **of_kind}


def read_subject_checks(path: Path, kinds: Sequence[str] = KINDS) -> SubjectChecks:
    """Read ``misspecification.h5``, or of its recordings those of some kinds alone.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    root, provenance = artefacts.load(path, KIND)
    return artefacts.from_dataset(
        SubjectChecks,
        root,
        subject=provenance.subject,
        recordings={
            kind: artefacts.from_dataset(statistics.Checks, artefacts.load(path, KIND, kind)[0])
            for kind in kinds
        },
        refused={kind: int(n) for kind, n in zip(KINDS, root["refused"].to_numpy(), strict=True)},
    )
