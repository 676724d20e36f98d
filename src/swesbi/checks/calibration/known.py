"""Recordings of known parameters: what makes them, and what is inferred of each by both samplers."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.base.progress import Progress
from swesbi.checks.calibration.dataset import (
    CalibrationRecordings,
    Diagnostics,
    FreshRecordings,
    InferredRecordings,
    PopulationCalibration,
    PushesCalibration,
)
from swesbi.checks.calibration.ranks import (
    RankedRecordings,
    prior_variance,
    quantities,
    quantity_names,
    rank,
    reference_points,
)
from swesbi.checks.settings import PushesSettings, RecordingsSettings
from swesbi.draws import equal_weights, resampled_rows
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, predict_draws, speed_model
from swesbi.measurement.settings import MeasurementSettings
from swesbi.networks.flow.trained import TrainedFlow, flow_proposal
from swesbi.population.recordings import (
    MODEL_NOISE,
    SAMPLE_BY_SAMPLE,
    STREAMS,
    Acquisition,
    FreshSettings,
    Synthetic,
    acquired_recordings,
    fresh_subject,
    own_recordings,
    record_fresh,
    record_pushes,
    recorded,
)
from swesbi.posterior.exact import weighted_posterior
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.settings import ExactSettings
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.recording.settings import AcquisitionSettings, RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.seeds import generator, integer_seed
from swesbi.verdict.nulls import misfits_of

LOGGER = logging.getLogger("swesbi")
STREAM: Final = "calibration"
FRESH_STREAM: Final = "population calibration"
PUSHES_STREAM: Final = "pushes"


@dataclass(frozen=True)
class KnownRecording:
    """A recording under its model whose parameters phi (d,) are known.

    ``reference`` (d,) is the standardised reference point of the joint coverage, ``stream`` the seed of what
    is drawn to infer it, ``misfits`` the stream behind what the verdict sees, and ``relative_se`` the
    standard error of a whole phase over its speed, NaN where there is no such phase.
    """

    model: SpeedModel
    phi: FloatArray
    reference: FloatArray
    stream: int
    misfits: str = "misfit"
    relative_se: float = np.nan


def of_subject(model: SpeedModel, made: Synthetic, seed: int, name: str) -> Iterator[KnownRecording]:
    """Yield the recordings that were made in the place of a subject's own; ``name`` is of their streams."""
    subject = model.recording.subject
    rng = generator(seed, "calibration", "tarp", name, subject)
    references = reference_points(len(made.phi), model.settings.prior, rng)
    for index, recording in enumerate(made.recordings):
        stream = integer_seed(seed, "calibration", "exact", name, subject, index)
        yield KnownRecording(replace(model, recording=recording), made.phi[index], references[index], stream)


def of_fresh(numbers: Iterable[int], kind: str, fresh: FreshSettings, seed: int) -> Iterator[KnownRecording]:
    """Yield one recording of each of the numbered contexts of a population that ingestion does not refuse.

    Each has random streams of its own, so neither the order nor other numbers matter.
    """
    for number in numbers:
        subject = fresh_subject(number, fresh, seed, FRESH_STREAM)
        made = record_fresh(subject, kind, fresh, seed, FRESH_STREAM, STREAMS[kind])
        if made.recordings:
            model = recorded(subject, made)
            (known,) = of_subject(model, made, seed, f"population {STREAMS[kind]}")
            yield replace(known, relative_se=subject.level)


def of_pushes(
    numbers: Iterable[int], pushes: Iterable[int], fresh: FreshSettings, seed: int
) -> Iterator[KnownRecording]:
    """Yield a free-running recording of each of the numbered contexts and each number of pushes."""
    for number, count in product(numbers, pushes):
        model, phi = record_pushes(number, (count, count), fresh, seed, PUSHES_STREAM, count)
        stream = integer_seed(seed, "calibration", PUSHES_STREAM, count, number)
        reference = reference_points(1, model.settings.prior, generator(stream, "tarp"))[0]
        yield KnownRecording(model, phi, reference, stream, "residuals")


def infer(
    known: KnownRecording, flow: TrainedFlow, settings: RecordingsSettings, exact: ExactSettings
) -> InferredRecordings:
    """Infer a recording by the network alone and exactly, and rank its phi among the draws of both; one row.

    ``settings`` say how many draws each takes, ``exact`` is the study's own way to the exact posterior.
    """
    model, phi, stream = known.model, known.phi, known.stream
    prior, network = model.settings.prior, flow_proposal(flow, model.recording)
    drawn, rounds = weighted_posterior(HeartModel(model), network, settings.effective_draws, exact, stream)
    from_network = slice(rounds.counts[0], rounds.counts[0] + settings.network_draws)
    proposed, of_proposed = rounds.known.phi[from_network], rounds.known.log_likelihood_of_phi[from_network]
    both = np.concatenate([phi[None], proposed])
    log_likelihood = np.concatenate([model.log_likelihood(phi[None]), of_proposed])
    truth, *rest = quantities(both, log_likelihood, model.activation_duration_s(both))
    values = quantities(drawn.phi, drawn.log_likelihood, model.activation_duration_s(drawn.phi))
    rng = generator(stream, known.misfits)
    predicted = predict_draws(model, drawn.phi[resampled_rows(drawn.weight, settings.misfit_draws, rng)])
    ranked = RankedRecordings(
        names=quantity_names(prior),
        subject=np.array([model.recording.subject]),
        truth=truth[None],
        prior_variance=prior_variance(model)[None],
        network=rank(truth, np.stack(rest), equal_weights(len(rest)), known.reference, prior),
        weighted=rank(truth, values, drawn.weight, known.reference, prior),
    )
    judged = (drawn.k_hat, drawn.efficiency, drawn.log_evidence, drawn is not rounds.weighted)
    diagnostics = Diagnostics(*(np.array([value]) for value in judged))
    return InferredRecordings(ranked, diagnostics, misfits_of(model, drawn.phi, drawn.weight, predicted, rng))


def infer_all(
    made: Iterable[KnownRecording],
    asked: int,
    what: str,
    flow: TrainedFlow,
    settings: RecordingsSettings,
    exact: ExactSettings,
) -> FreshRecordings:
    """Infer the recordings that were made, of so many that were asked for; ``what`` names them.

    Refuses to go on where ingestion refused all of them.
    """
    progress, parts = Progress(f"calibration, {what}", asked, unit="recording"), []
    for known in made:
        context, level = known.model.recording.context, np.array([known.relative_se])
        parts.append(FreshRecordings((context,), level, infer(known, flow, settings, exact), 0))
        progress.step()
    if not parts:
        raise ValueError(f"{what}: all {asked} synthetic recordings were refused; check their conditions")
    found = replace(FreshRecordings.joined(parts), refused=asked - len(parts))
    LOGGER.info("%s: %d of %d refused; %s", what, found.refused, asked, found.inferred.diagnostics)
    return found


def recordings_like_subject(
    observation: Observation,
    noise: CohortNoise,
    estimator: TrainedFlow,
    *,
    model: SpeedModelSettings,
    exact: ExactSettings,
    acquisition: AcquisitionSettings,
    recording: RecordingSettings,
    recordings: RecordingsSettings,
    seed: int,
) -> CalibrationRecordings:
    """Make recordings in the subject's context and with its phases, and infer every one.

    Half of the runs have the model's own noise and discrepancy. The others start from the same phi but are
    acquired sample by sample, with the discrepancy drawn for each phase, pass quality control and ingestion,
    get their standard errors from the cohort's variance components and their own counts, and have their own
    phases; the passive stiffness is inferred with the rest. Recordings that ingestion refuses are left out,
    and the log says how many.

    Raises:
        ValueError: Ingestion refused every recording.
    """
    subject, recorded = observation.subject, speed_model(observation, noise, model)
    made = acquisition_of(observation, noise.of(subject), acquisition, recording, model.measurement)
    own, acquired = recordings.model_noise, recordings.sample_by_sample
    synthetic = {
        MODEL_NOISE: (own_recordings(recorded, own, seed, STREAM), own),
        SAMPLE_BY_SAMPLE: (acquired_recordings(recorded, made, acquired, seed, STREAM), acquired),
    }
    infer_each = partial(infer_all, flow=estimator, settings=recordings, exact=exact)
    return CalibrationRecordings(
        **{
            kind: infer_each(
                of_subject(recorded, of_kind, seed, STREAMS[kind]), asked, f"{subject}, {kind}"
            ).inferred
            for kind, (of_kind, asked) in synthetic.items()
        }
    )


def acquisition_of(
    observed: Observation,
    noise: NoiseComponents,
    acquisition: AcquisitionSettings,
    recording: RecordingSettings,
    measurement: MeasurementSettings,
) -> Acquisition:
    """Return how recordings like the subject's are made: with the errors of its group."""
    missing = tuple(int(index) for index in observed.phase_index[~observed.measured])
    return Acquisition.with_noise(acquisition, noise, missing, recording, measurement)


def calibration_on_fresh(
    estimator: TrainedFlow,
    *,
    model_noise_numbers: tuple[int, int],
    sample_by_sample_numbers: tuple[int, int],
    fresh: FreshSettings,
    recordings: RecordingsSettings,
    exact: ExactSettings,
    seed: int,
) -> PopulationCalibration:
    """Infer one recording of each of the numbered contexts, under the model's own noise and acquired.

    Numbers are those of the first context, and of one past the last.

    Raises:
        ValueError: Ingestion refused every recording.
    """
    numbers = {MODEL_NOISE: range(*model_noise_numbers), SAMPLE_BY_SAMPLE: range(*sample_by_sample_numbers)}
    infer_each = partial(infer_all, flow=estimator, settings=recordings, exact=exact)
    return PopulationCalibration(
        **{
            kind: infer_each(of_fresh(asked, kind, fresh, seed), len(asked), f"fresh contexts, {kind}")
            for kind, asked in numbers.items()
        }
    )


def pushes_on_fresh(
    estimator: TrainedFlow,
    *,
    pushes_numbers: tuple[int, int],
    fresh: FreshSettings,
    free_running: PushesSettings,
    recordings: RecordingsSettings,
    exact: ExactSettings,
    seed: int,
) -> PushesCalibration:
    """Infer a free-running recording of each of the numbered contexts and each number of pushes."""
    known = list(of_pushes(range(*pushes_numbers), free_running.pushes, fresh, seed))
    return PushesCalibration(infer_all(known, len(known), "pushes", estimator, recordings, exact))
