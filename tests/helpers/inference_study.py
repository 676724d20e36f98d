"""Two small subjects of the real forward model as files, for the tests of the inference stages."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from forward_model_cases import SETTINGS as FORWARD_MODEL
from inference_case import CONTEXTS, PAPER_PRIOR, estimator_settings
from recordings import PHASES, RECORDING, make_samples, nominal_phase

from swesbi.artefacts import Origin, save, to_groups
from swesbi.artefacts import to_dataset as passive_to_dataset
from swesbi.checks.settings import RecoverySettings
from swesbi.context import Context
from swesbi.heart.prior_simulations import draw_simulations
from swesbi.heart.prior_simulations import to_dataset as simulations_to_dataset
from swesbi.heart.simulate import simulate
from swesbi.measurement.likelihood import MeasuredSubject
from swesbi.measurement.operator import calibrate_passive, passive_shape
from swesbi.measurement.settings import MeasurementSettings, PassiveSettings, SummarySettings
from swesbi.networks.settings import ObservationModelSettings
from swesbi.posterior.settings import PosteriorSettings
from swesbi.prior import log_centre
from swesbi.recording.ingest import ingest
from swesbi.recording.phases import sample_cycle
from swesbi.study.stages import inference, simulation, training
from swesbi.verdict.settings import SupportSettings

DRAWS = 60
TRUTH = np.array([[58.0, 6.0, 28.0]])
MEASUREMENT = MeasurementSettings(grid_points=100, active_stiffness_map="identity")
SUMMARY = SummarySettings(baseline_window=(0.8, 0.97), trajectory_points=30, use_trajectory=True)
PASSIVE = PassiveSettings(exponent_b=3.0, late_diastolic_window=(0.8, 0.97))
NOISE = ObservationModelSettings(
    feature_noise_sd={
        "maximum_kpa": 1.0,
        "auc_kpa": 0.5,
        "post_peak_auc_kpa": 0.5,
        "decay_slope_kpa_per_cycle": 5.0,
        "time_to_peak_cycle": 0.03,
    },
    augmentations=3,
)
POOL = simulation.PoolStageSettings(
    simulations_per_subject=DRAWS, measurement=MEASUREMENT, summary=SUMMARY, observation_model=NOISE
)
TRAIN = training.TrainStageSettings(
    prior=PAPER_PRIOR,
    estimator=estimator_settings(procedure="fast", max_num_epochs=6, learning_rate=2e-3),
    checkpoint_epochs=(1, 3),
)
POSTERIOR = inference.PosteriorStageSettings(
    prior=PAPER_PRIOR,
    support=SupportSettings(max_abs_z=3.0, min_in_prior_draws=50, candidate_draws=2000),
    posterior=PosteriorSettings(draws=300, unfiltered_draws=100, interval=0.9),
)
RECOVERY = inference.RecoveryStageSettings(
    prior=PAPER_PRIOR,
    forward_model=FORWARD_MODEL,
    measurement=MEASUREMENT,
    summary=SUMMARY,
    observation_model=NOISE,
    recovery=RecoverySettings(
        recordings=9, candidate_draws=200, min_in_prior_draws=5, nominal_levels=(0.5, 0.9), confidence=0.95
    ),
)


@dataclass(frozen=True)
class Inputs:
    """Files of the subjects; shards in pieces, or each subject's in one."""

    observations: tuple[Path, ...]
    passives: tuple[Path, ...]
    shards: tuple[Path, ...]
    whole_shards: tuple[Path, ...]


def measured_subject(context: Context, missing_phase: int | None = None) -> MeasuredSubject:
    """A noisy recording at ``TRUTH`` and the passive baseline calibrated on it."""
    beats = simulate(TRUTH, context, FORWARD_MODEL)
    reference = simulate(log_centre(PAPER_PRIOR)[None], context, FORWARD_MODEL)
    total = beats.active_stiffness_kpa + 4.0 * passive_shape(beats.stretch, 3.0)
    speed = np.sqrt(sample_cycle(beats.cycle_phase, total, nominal_phase())[0] / 3.0)
    observed = ingest(make_samples(speed, 0.04, 0.08, seed=3), context, RECORDING, 100)
    if missing_phase is not None:
        observed = replace(observed, measured=np.arange(PHASES) != missing_phase)
    return MeasuredSubject(
        observed, calibrate_passive(observed, reference, PASSIVE, MEASUREMENT), MEASUREMENT
    )


def write_subject(folder: Path, context: Context) -> Inputs:
    subject = measured_subject(context, missing_phase=11 if context.subject == "B" else None)
    origin = Origin(1, context.subject)
    observation, passive = folder / "observation.h5", folder / "passive.h5"
    save(
        observation,
        to_groups(subject.observation),
        origin.provenance("observation", MEASUREMENT),
    )
    save(passive, passive_to_dataset(subject.passive), origin.provenance("passive", MEASUREMENT))
    parts = {"shard-1": range(35, DRAWS), "shard-0": range(35), "whole": range(DRAWS)}
    files = {name: folder / f"{name}.h5" for name in parts}
    for name, draws in parts.items():
        made = draw_simulations(draws, context, PAPER_PRIOR, FORWARD_MODEL, 1)
        save(files[name], simulations_to_dataset(made), origin.provenance("simulations", PAPER_PRIOR))
    return Inputs((observation,), (passive,), (files["shard-1"], files["shard-0"]), (files["whole"],))


def write_inputs(folder: Path) -> Inputs:
    parts = [write_subject(folder / context.subject, context) for context in CONTEXTS]
    names = ("observations", "passives", "shards", "whole_shards")
    return Inputs(*(sum((getattr(part, name) for part in parts), ()) for name in names))


def make_pool(
    path: Path, inputs: Inputs, shards: Sequence[Path], settings: simulation.PoolStageSettings
) -> None:
    simulation.pool(
        observations=inputs.observations,
        passives=inputs.passives,
        shards=shards,
        pool=path,
        settings=settings,
        origin=Origin(9),
    )


def run_all(folder: Path, inputs: Inputs, shards: Sequence[Path]) -> None:
    pooled, estimator = folder / "pool.h5", folder / "estimator.pt"
    make_pool(pooled, inputs, shards, POOL)
    losses = folder / "training.csv"
    training.train(
        pool=pooled,
        estimator=estimator,
        training=losses,
        checkpoints=folder / "checkpoints.pt",
        settings=TRAIN,
        origin=Origin(9),
        device="cpu",
    )
    for context in CONTEXTS:
        inference.posterior(
            pool=pooled,
            estimator=estimator,
            posterior=folder / f"{context.subject}.h5",
            verdict=folder / f"{context.subject}.json",
            settings=POSTERIOR,
            origin=Origin(9, context.subject),
        )
    inference.recovery(
        pool=pooled,
        estimator=estimator,
        passives=inputs.passives[::-1],
        observations=inputs.observations,
        recovery=folder / "recovery.csv",
        settings=RECOVERY,
        origin=Origin(9),
    )
