"""Stage: the exact posteriors of the cohort under one variant of the configuration."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from swesbi.artefacts import load, save
from swesbi.exact.mcmc import sample_mcmc
from swesbi.exact.posterior import exact_posterior
from swesbi.exact.proposal import flow_proposal
from swesbi.exact.settings import ExactSettings
from swesbi.flow.net import TrainedFlow
from swesbi.flow.simulations import SubjectSimulations, at_phases
from swesbi.flow.training import train_flow
from swesbi.observation.dataset import KIND as PASSIVE
from swesbi.observation.dataset import read_passive
from swesbi.parameters import SCALE
from swesbi.prior import ParameterPrior, quantile
from swesbi.seeds import generator, integer_seed
from swesbi.sensitivity.posteriors import KIND, VariantPosterior, to_dataset
from swesbi.settings import Settings
from swesbi.simulations.draw import draw_simulations
from swesbi.speed_model.model import SpeedModel
from swesbi.speed_model.subjects import read_speed_models
from swesbi.stages.origin import Origin
from swesbi.stages.train_flow import TrainFlowStageSettings

LOGGER = logging.getLogger("swesbi")
FIXED_LOG_SD: Final = 1e-3  # a passive scale taken for granted: a prior of no width to speak of
FIXED_BOUNDS: Final = (0.99, 1.01)


class SensitivityRunStageSettings(Settings):
    """What the posteriors of a variant depend on: the changed configuration, its seed among it."""

    seed: int
    simulations_per_subject: int
    train: TrainFlowStageSettings
    exact: ExactSettings
    fix_passive_scale: bool


def run(
    *,
    observations: Sequence[Path],
    noise: Path,
    passives: Sequence[Path],
    posteriors: Path,
    settings: SensitivityRunStageSettings,
    origin: Origin,
) -> None:
    """Simulate, train and infer every subject under the variant, all in memory.

    Raises:
        ArtefactError: An input cannot be read.
    """
    models = read_speed_models(observations, noise, settings.train.model)
    simulated = [_simulations(model, settings) for model in models]
    seed = integer_seed(settings.seed, "flow training")
    label = f"variant {posteriors.stem}"
    flow = train_flow(simulated, settings.train.conditioning, settings.train.estimator, seed, label).flow
    scales = {load(path, PASSIVE)[1].subject: read_passive(path).scale_kpa for path in passives}
    found = [_infer(model, flow, scales, settings) for model in models]
    save(posteriors, to_dataset(found), origin.provenance(KIND, settings))
    for part in found:
        LOGGER.info("%s, subject %s: %s, efficiency %.2f", label, part.subject, part.sampler, part.efficiency)


def _simulations(model: SpeedModel, settings: SensitivityRunStageSettings) -> SubjectSimulations:
    prior, context = model.settings.prior.theta, model.recording.context
    draws = range(settings.simulations_per_subject)
    return at_phases(
        draw_simulations(draws, context, prior, model.settings.forward_model, settings.seed), model
    )


def _infer(
    model: SpeedModel, flow: TrainedFlow, scales: dict[str, float], settings: SensitivityRunStageSettings
) -> VariantPosterior:
    subject = model.recording.subject
    if settings.fix_passive_scale:
        return _with_fixed_scale(model, flow, scales[subject], settings)
    seed = integer_seed(settings.seed, "exact", subject)
    found = exact_posterior(model, flow_proposal(flow, model.recording), settings.exact, seed)
    by_mcmc = found.sampler == "mcmc"
    return VariantPosterior(subject, found.phi, by_mcmc, found.k_hat, found.efficiency, found.converged)


def _with_fixed_scale(
    model: SpeedModel, flow: TrainedFlow, scale_kpa: float, settings: SensitivityRunStageSettings
) -> VariantPosterior:
    """Sample the posterior with the passive scale held, by MCMC: the flow has no such proposal."""
    low, high = (scale_kpa * factor for factor in FIXED_BOUNDS)
    fixed = ParameterPrior(centre=scale_kpa, log_sd=FIXED_LOG_SD, low=low, high=high)
    prior = model.settings.prior.model_copy(update={"passive_scale_kpa": fixed})
    held = replace(model, settings=model.settings.model_copy(update={"prior": prior}))
    subject, mcmc = model.recording.subject, settings.exact.mcmc
    seed = integer_seed(settings.seed, "exact", subject)
    start = flow_proposal(flow, model.recording).draw(mcmc.start_points, seed)
    rng = generator(settings.seed, "exact", "fixed scale", subject)
    start[:, SCALE] = quantile(rng.random(start.shape), prior)[:, SCALE]
    sampled = sample_mcmc(held, start, mcmc, seed)
    phi = sampled.thinned(settings.exact.draws, rng)
    return VariantPosterior(subject, phi, True, float("nan"), float("nan"), sampled.converged)
