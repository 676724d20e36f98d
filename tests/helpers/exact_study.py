"""A recording, its noise and the smallest network on disk: what stages with an exact likelihood read."""

from __future__ import annotations

from pathlib import Path

import speed_case
import spline_case
from exact_case import SETTINGS
from recordings import RECORDING, make_samples

from swesbi.artefacts import Provenance, save, to_groups
from swesbi.networks.flow.files import KIND, save_flow
from swesbi.recording.ingest import ingest
from swesbi.recording.noise.cohort import KIND as NOISE
from swesbi.recording.noise.cohort import fit_cohort, to_dataset
from swesbi.recording.noise.components import RepeatLevels
from swesbi.recording.observation import KIND as OBSERVATION
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


def write_inputs(folder: Path) -> dict[str, Path]:
    """Write observation, noise and network of one subject; return their paths by name."""
    speeds = speed_case.model().recording.speed_m_s
    samples = make_samples(speeds, repeat_sd=0.04, sample_sd=0.08, seed=1)
    observed = ingest(samples, speed_case.CONTEXT, RECORDING, 100)
    noise = fit_cohort({"T": RepeatLevels.of(samples, rejection(samples, RECORDING) == ACCEPTED)}, {})
    paths = {"observation": folder / "observation.h5", "noise": folder / "noise.h5"}
    save(paths["observation"], to_groups(observed), Provenance(OBSERVATION, "T", 1, {}, "c"))
    save(paths["noise"], to_dataset(noise), Provenance(NOISE, "", 1, {}, "c"))
    flow = spline_case.trained(epochs=30).flow
    save_flow(folder / "flow.h5", flow, Provenance(KIND, "", 1, {}, "0" * 16))
    return {**paths, "estimator": folder / "flow.h5"}
