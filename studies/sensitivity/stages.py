"""Variants of one experiment: each simulated, trained and inferred anew, and what they move."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import Final, NamedTuple

from studies.sensitivity.figure import draw_sensitivity
from studies.sensitivity.variants import VariantPosterior, VariantPosteriors, sensitivity_table
from swesbi.artefacts.csv import PlainTable
from swesbi.artefacts.typed import ByName, BySubject
from swesbi.heart.prior_simulations import draw_simulations
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, speed_model
from swesbi.measurement.operator import PassiveBaseline
from swesbi.measurement.settings import SummarySettings
from swesbi.networks.flow.conditioning import conditioning_of
from swesbi.networks.flow.pool import SubjectSimulations, at_phases
from swesbi.networks.flow.trained import FlowProposal, flow_proposal
from swesbi.networks.settings import FlowSettings
from swesbi.parameters import OF_INTEREST, ParameterPrior
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.settings import ExactSettings
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.report.figures.style import Drawing
from swesbi.seeds import integer_seed

LOGGER = logging.getLogger("swesbi")
FIXED_LOG_SD: Final = 1e-3  # a passive scale taken for granted: a prior of no width to speak of
FIXED_BOUNDS: Final = (0.99, 1.01)


def sensitivity_run(
    observations: tuple[Observation, ...],
    noise: CohortNoise,
    passives: BySubject[PassiveBaseline],
    *,
    variant: str,
    variant_seed: int,
    simulations_per_subject: int,
    model: SpeedModelSettings,
    summary: SummarySettings,
    estimator: FlowSettings,
    exact: ExactSettings,
    fix_passive_scale: bool,
) -> VariantPosteriors:
    """Simulate, train and infer every subject under the variant, all in memory.

    Where the passive scale is held, subjects are inferred without the network: it has no such proposal.

    Args:
        passives: They say where the passive scale is held.
        variant_seed: Of everything that is drawn: a choice that a variant can make otherwise.
    """
    from swesbi.networks.flow.training import (
        train_over_subjects,  # torch, of which the other stages need nothing
    )

    models = [speed_model(observed, noise, model) for observed in observations]
    simulated = [_simulations(each, simulations_per_subject, variant_seed) for each in models]
    training_seed, label = integer_seed(variant_seed, "flow training"), f"variant {variant}"
    conditioning = conditioning_of(summary, model)
    flow = train_over_subjects(simulated, conditioning, estimator, training_seed, label).estimator
    inferred = []
    for each in models:
        if fix_passive_scale:
            held = _with_scale(each, stretched_kpa(passives[each.recording.subject]))
            found = _infer(held, None, exact, variant_seed)
        else:
            found = _infer(each, flow_proposal(flow, each.recording), exact, variant_seed)
        inferred.append(found)
        LOGGER.info(
            "%s, subject %s: %s, efficiency %.2f", label, found.subject, found.sampler, found.efficiency
        )
    return VariantPosteriors(tuple(inferred))


def stretched_kpa(baseline: PassiveBaseline) -> float:
    """Return the passive stiffness of a baseline at the largest stretch of its reference beat, in kPa."""
    return float(baseline.stiffness_kpa[baseline.stretch.argmax()])


def _simulations(model: SpeedModel, number: int, seed: int) -> SubjectSimulations:
    prior, context = model.settings.prior.theta, model.recording.context
    made = draw_simulations(range(number), context, prior, model.settings.forward_model, seed)
    return at_phases(made, model)


def _infer(
    model: SpeedModel, proposal: FlowProposal | None, settings: ExactSettings, seed: int
) -> VariantPosterior:
    subject = model.recording.subject
    exact, _ = exact_posterior(HeartModel(model), proposal, settings, seed, "exact", subject)
    by_mcmc, phi = exact.sampler == "mcmc", exact.phi[:, OF_INTEREST]
    return VariantPosterior(subject, phi, by_mcmc, exact.k_hat, exact.efficiency, exact.converged)


def _with_scale(model: SpeedModel, scale_kpa: float) -> SpeedModel:
    """Return a model with the passive stiffness held at a value, by a prior of nearly no width."""
    low, high = (scale_kpa * factor for factor in FIXED_BOUNDS)
    fixed = ParameterPrior(centre=scale_kpa, log_sd=FIXED_LOG_SD, low=low, high=high)
    prior = model.settings.prior.model_copy(update={"passive_stiffness_kpa": fixed})
    return replace(model, settings=model.settings.model_copy(update={"prior": prior}))


class Sensitivity(NamedTuple):
    """How far medians and intervals move under each variant, and its figure."""

    table: PlainTable
    figure: Drawing


def sensitivity(
    variants: ByName[VariantPosteriors], *, cohort_title: str, interval: float, labels: dict[str, str]
) -> Sensitivity:
    """Compare the posteriors under each variant with the base's.

    Args:
        interval: Mass of the intervals.
        labels: What each variant is called, in the order shown.
    """
    posteriors = {name: variants[name].of for name in labels}
    table = sensitivity_table(posteriors, labels, interval)
    return Sensitivity(table, draw_sensitivity(table, cohort_title))
