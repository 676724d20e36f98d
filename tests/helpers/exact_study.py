"""A recording, its noise and the smallest network: what stages with an exact likelihood take."""

from __future__ import annotations

import flow_case
import speed_case
from exact_case import SETTINGS
from recordings import RECORDING, make_samples

from swesbi.networks.flow.trained import TrainedFlow
from swesbi.recording.ingest import ingest
from swesbi.recording.noise.cohort import CohortNoise, fit_cohort
from swesbi.recording.noise.components import RepeatLevels
from swesbi.recording.observation import Observation
from swesbi.recording.quality import rejection
from swesbi.recording.samples import ACCEPTED

EXACT = SETTINGS.model_copy(
    update={
        "first_draws": 500,
        "round_draws": 500,
        "max_rounds": 4,
        "effective_draws": 100,
        "min_effective_draws": 50,
        "draws": 800,
        "mcmc": SETTINGS.mcmc.model_copy(
            update={"walkers": 16, "steps": 24, "max_steps": 24, "max_r_hat": 9.0, "min_effective_draws": 1}
        ),
    }
)


def inputs() -> tuple[Observation, CohortNoise, TrainedFlow]:
    """Return the observation of one subject, its noise and a network."""
    speeds = speed_case.model().recording.speed_m_s
    samples = make_samples(speeds, repeat_sd=0.04, sample_sd=0.08, seed=1)
    noise = fit_cohort({"T": RepeatLevels.of(samples, rejection(samples, RECORDING) == ACCEPTED)}, {})
    return ingest(samples, speed_case.CONTEXT, RECORDING, 100), noise, flow_case.trained(epochs=30).estimator
