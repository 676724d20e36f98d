"""A recording, its noise and the smallest network on disk: what stages with an exact likelihood read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import speed_case
from exact_case import SETTINGS
from recordings import RECORDING, make_samples

from swesbi.artefacts import Provenance, save, to_groups
from swesbi.networks.spline.conditioning import ConditioningSettings
from swesbi.networks.spline.files import KIND, save_spline
from swesbi.networks.spline.pool import SubjectSimulations
from swesbi.networks.spline.training import train_spline
from swesbi.prior import quantile
from swesbi.recording.components import repeat_levels
from swesbi.recording.ingest import ingest
from swesbi.recording.noise import KIND as NOISE
from swesbi.recording.noise import fit_noise, to_dataset
from swesbi.recording.observation import KIND as OBSERVATION
from swesbi.recording.samples import ACCEPTED, rejection

EXPERIMENT = speed_case.shipped().speed_experiments["calibrated"]
EXACT = SETTINGS.model_copy(
    update={
        "proposal_draws": 500,
        "draws": 800,
        "mcmc": SETTINGS.mcmc.model_copy(
            update={"walkers": 16, "steps": 24, "max_steps": 24, "max_r_hat": 9.0, "min_effective_draws": 1}
        ),
    }
)


def write_network(path: Path) -> None:
    """Train the smallest network for a moment on prior simulations of one subject."""
    model = speed_case.model()
    theta = quantile(np.random.default_rng(1).random((600, 3)), model.settings.prior.theta)
    beats = model.simulate(np.column_stack([theta, np.full(600, 2.2)]))
    wall = model.wall_at_phases(beats)
    conditioning = ConditioningSettings(summary=EXPERIMENT.summary, grid_points=100, density_kg_m3=1000.0)
    settings = EXPERIMENT.estimator.model_copy(
        update={"transforms": 1, "hidden_features": 16, "hidden_layers": 1, "epochs": 8, "batch_size": 64}
    )
    simulated = SubjectSimulations(model, theta, np.empty((len(theta), 0)), wall)
    flow = train_spline([simulated], conditioning, settings, seed=3).spline
    save_spline(path, flow, Provenance(KIND, "", 1, {}, "0" * 16))


def write_inputs(folder: Path) -> dict[str, Path]:
    """Write observation, noise and network of one subject; return their paths by name."""
    speeds = speed_case.model().recording.speed_m_s
    samples = make_samples(speeds, repeat_sd=0.04, sample_sd=0.08, seed=1)
    observed = ingest(samples, speed_case.CONTEXT, RECORDING, 100)
    noise = fit_noise({"T": repeat_levels(samples, rejection(samples, RECORDING) == ACCEPTED)})
    paths = {"observation": folder / "observation.h5", "noise": folder / "noise.h5"}
    save(paths["observation"], to_groups(observed), Provenance(OBSERVATION, "T", 1, {}, "c"))
    save(paths["noise"], to_dataset(noise), Provenance(NOISE, "", 1, {}, "c"))
    write_network(folder / "estimator.pt")
    return {**paths, "estimator": folder / "estimator.pt"}
