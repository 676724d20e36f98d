"""Two small subjects of the real forward model, for the tests of the stages of inference."""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import speed_case
from forward_model_cases import SETTINGS as FORWARD_MODEL
from inference_case import CONTEXTS, PAPER_PRIOR, estimator_settings
from recordings import PHASES, RECORDING, make_samples, nominal_phase

from swesbi.artefacts import Provenance
from swesbi.checks import recovery as recoveries
from swesbi.checks.settings import RecoverySettings
from swesbi.context import Context
from swesbi.heart.prior_simulations import PriorSimulations, draw_simulations
from swesbi.heart.simulate import simulate
from swesbi.measurement.likelihood import MeasuredSubject
from swesbi.measurement.operator import PassiveBaseline, calibrate_passive, passive_shape
from swesbi.measurement.settings import SummarySettings
from swesbi.networks.paper import pool as pools
from swesbi.networks.paper import training
from swesbi.networks.paper.pool import Pool
from swesbi.networks.paper.training import TrainedNetwork
from swesbi.networks.training import TRAINING
from swesbi.posterior.settings import PosteriorSettings
from swesbi.prior import log_centre
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import Observation
from swesbi.recording.phases import sample_cycle
from swesbi.verdict import prior_support
from swesbi.verdict.prior_support import PosteriorVerdict
from swesbi.verdict.settings import SupportSettings

DRAWS = 60
TRUTH = np.array([[58.0, 6.0, 28.0]])
SHIPPED = speed_case.shipped()
MEASUREMENT, PASSIVE = SHIPPED.measurement, SHIPPED.passive
SUMMARY = SummarySettings(baseline_window=(0.8, 0.97), trajectory_points=30, use_trajectory=True)
NOISE = SHIPPED.experiments["paper"].observation_model.model_copy(update={"augmentations": 3})
SEED = 9
OBSERVED = {"measurement": MEASUREMENT, "summary": SUMMARY, "observation_model": NOISE}
POOL = OBSERVED | {"simulations_per_subject": DRAWS, "seed": SEED}
TRAIN = {
    "prior": PAPER_PRIOR,
    "estimator": estimator_settings(procedure="fast", max_num_epochs=6, learning_rate=2e-3),
    "checkpoint_epochs": (1, 3),
    "experiment": "paper",
    "seed": SEED,
}
POSTERIOR = {
    "prior": PAPER_PRIOR,
    "support": SupportSettings(max_abs_z=3.0, min_in_prior_draws=50, candidate_draws=2000),
    "posterior": PosteriorSettings(draws=300, unfiltered_draws=100, interval=0.9),
    "seed": SEED,
}
RECOVERY = OBSERVED | {
    "prior": PAPER_PRIOR,
    "forward_model": FORWARD_MODEL,
    "recovery": RecoverySettings(
        recordings=9, candidate_draws=200, min_in_prior_draws=5, nominal_levels=(0.5, 0.9), confidence=0.95
    ),
    "seed": SEED,
}


class Inputs(NamedTuple):
    """What is known of the subjects; shards put together of pieces, or each subject's as one."""

    observations: tuple[Observation, ...]
    passives: dict[str, PassiveBaseline]
    shards: dict[str, PriorSimulations]
    whole_shards: dict[str, PriorSimulations]


class Results(NamedTuple):
    """What the stages make of them."""

    pool: Pool
    trained: TrainedNetwork
    judged: dict[str, PosteriorVerdict]
    recovery: pd.DataFrame

    def write(self, folder: Path) -> None:
        made = Provenance("", "", SEED, {"a": 1}, "c")
        self.pool.write(folder / "pool.h5", made)
        self.trained.estimator.write(folder / "estimator.h5", made)
        self.trained.checkpoints.write(folder / "checkpoints.h5", made)
        TRAINING.write(self.trained.training, folder / "training.csv")
        for name, judged in self.judged.items():
            judged.posterior.write(folder / f"{name}.h5", made)
            judged.verdict.write(folder / f"{name}.json", made)
        TRAINING.write(self.recovery, folder / "recovery.csv")


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


def make_inputs() -> Inputs:
    subjects = [
        measured_subject(context, missing_phase=11 if context.subject == "B" else None)
        for context in CONTEXTS
    ]
    return Inputs(
        tuple(subject.observation for subject in subjects),
        {subject.observation.subject: subject.passive for subject in subjects},
        {context.subject: simulated(context, range(35, DRAWS), range(35)) for context in CONTEXTS},
        {context.subject: simulated(context, range(DRAWS)) for context in CONTEXTS},
    )


def simulated(context: Context, *shards: range) -> PriorSimulations:
    parts = [draw_simulations(draws, context, PAPER_PRIOR, FORWARD_MODEL, 1) for draws in shards]
    return PriorSimulations.joined(parts)


def make_pool(inputs: Inputs, **changed: object) -> Pool:
    return pools.pool_of_features(inputs.observations, inputs.passives, inputs.shards, **(POOL | changed))


def run_all(inputs: Inputs) -> Results:
    pool = make_pool(inputs)
    trained = training.trained_network(pool, **TRAIN, device="cpu")
    judged = {
        context.subject: prior_support.judged_posterior(
            pool, trained.estimator, subject=context.subject, **POSTERIOR
        )
        for context in CONTEXTS
    }
    passives = dict(reversed(inputs.passives.items()))
    recovery = recoveries.own_recovery(pool, trained.estimator, inputs.observations, passives, **RECOVERY)
    return Results(pool, trained, judged, recovery)
