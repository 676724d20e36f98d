"""Variants of one experiment: each simulated, trained and inferred anew, and what they move."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from studies.sensitivity.figure import draw_sensitivity
from studies.sensitivity.variants import VariantPosterior, VariantPosteriors, sensitivity_table
from swesbi.artefacts import Origin
from swesbi.artefacts.csv import write_csv
from swesbi.artefacts.files import hdf5_provenance
from swesbi.base.settings import Settings
from swesbi.heart.prior_simulations import draw_simulations
from swesbi.measurement import likelihood
from swesbi.measurement.operator import PassiveBaseline
from swesbi.measurement.settings import SummarySettings
from swesbi.networks.flow.conditioning import conditioning_of
from swesbi.networks.flow.flow import flow_proposal
from swesbi.networks.flow.pool import SubjectSimulations, at_phases
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.networks.settings import SplineSettings
from swesbi.parameters import REPORTED
from swesbi.posterior import exact as posteriors
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.settings import ExactSettings
from swesbi.prior import ParameterPrior
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.report.figures.style import save_figure
from swesbi.seeds import integer_seed

LOGGER = logging.getLogger("swesbi")
FIXED_LOG_SD: Final = 1e-3  # a passive scale taken for granted: a prior of no width to speak of
FIXED_BOUNDS: Final = (0.99, 1.01)


class SensitivityRunStageSettings(Settings):
    """What the posteriors of a variant depend on: the changed configuration, its seed among it."""

    seed: int
    simulations_per_subject: int
    model: likelihood.SpeedModelSettings
    summary: SummarySettings
    estimator: SplineSettings
    exact: ExactSettings
    fix_passive_scale: bool


def sensitivity_run(
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
    from swesbi.networks.flow.training import (
        train_over_subjects,  # torch, of which the other stages need nothing
    )

    of_cohort = CohortNoise.read(noise)
    models = [
        likelihood.speed_model(Observation.read(path), of_cohort, settings.model) for path in observations
    ]
    simulated = [_simulations(model, settings) for model in models]
    seed = integer_seed(settings.seed, "flow training")
    label = f"variant {posteriors.stem}"
    conditioning = conditioning_of(settings.summary, settings.model)
    flow = train_over_subjects(simulated, conditioning, settings.estimator, seed, label).flow
    scales = {hdf5_provenance(path).subject: stretched_kpa(PassiveBaseline.read(path)) for path in passives}
    inferred = [_infer(model, flow, scales, settings) for model in models]
    VariantPosteriors(tuple(inferred)).write(posteriors, origin.provenance("", settings))
    for posterior in inferred:
        subject, efficiency = posterior.subject, posterior.efficiency
        LOGGER.info("%s, subject %s: %s, efficiency %.2f", label, subject, posterior.sampler, efficiency)


def stretched_kpa(baseline: PassiveBaseline) -> float:
    """Return the passive stiffness of a baseline at the largest stretch of its reference beat, in kPa."""
    return float(baseline.stiffness_kpa[baseline.stretch.argmax()])


def _simulations(model: likelihood.SpeedModel, settings: SensitivityRunStageSettings) -> SubjectSimulations:
    prior, context = model.settings.prior.theta, model.recording.context
    draws = range(settings.simulations_per_subject)
    return at_phases(
        draw_simulations(draws, context, prior, model.settings.forward_model, settings.seed), model
    )


def _infer(
    model: likelihood.SpeedModel,
    flow: TrainedFlow,
    scales: dict[str, float],
    settings: SensitivityRunStageSettings,
) -> VariantPosterior:
    """Infer one subject, without the network where the passive scale is held: it has no such proposal."""
    subject, held = model.recording.subject, settings.fix_passive_scale
    proposal = None if held else flow_proposal(flow, model.recording)
    if held:
        model = _with_scale(model, scales[subject])
    heart = HeartModel(model)
    exact, _ = posteriors.exact_posterior(heart, proposal, settings.exact, settings.seed, "exact", subject)
    by_mcmc = exact.sampler == "mcmc"
    phi = exact.phi[:, REPORTED]
    return VariantPosterior(subject, phi, by_mcmc, exact.k_hat, exact.efficiency, exact.converged)


def _with_scale(model: likelihood.SpeedModel, scale_kpa: float) -> likelihood.SpeedModel:
    """Return a model with the passive stiffness held at a value, by a prior of nearly no width."""
    low, high = (scale_kpa * factor for factor in FIXED_BOUNDS)
    fixed = ParameterPrior(centre=scale_kpa, log_sd=FIXED_LOG_SD, low=low, high=high)
    prior = model.settings.prior.model_copy(update={"passive_stiffness_kpa": fixed})
    return replace(model, settings=model.settings.model_copy(update={"prior": prior}))


class SensitivityStageSettings(Settings):
    """What the table and the figure call things; ``labels`` by variant, in the order shown."""

    cohort_title: str
    interval: float
    labels: dict[str, str]


def sensitivity(
    *,
    variants: Sequence[Path],
    table: Path,
    figure_pdf: Path,
    figure_png: Path,
    settings: SensitivityStageSettings,
    origin: Origin,
) -> None:
    """Write how far medians and intervals move under each variant; each file is named by its variant."""
    files = {path.stem: path for path in variants}
    posteriors = {name: VariantPosteriors.read(files[name]).of for name in settings.labels}
    frame = sensitivity_table(posteriors, settings.labels, settings.interval)
    write_csv(table, frame)
    save_figure(draw_sensitivity(frame, settings.cohort_title), figure_pdf, figure_png)
