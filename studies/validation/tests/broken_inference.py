"""Hearts of development, recorded as in the validation, answered without a network and with parts broken.

No trained network exists among the tests. Adaptive importance sampling, which begins with the prior, takes
its place: the posterior is the same, and what the validation scores is a posterior. In place of the verdict a
heart is contradicted where the posterior predictive chi2 has p < .05.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Final, Literal

import numpy as np
import speed_case
from validation_case import CONFIG, generators

from studies.validation.hearts.generators import Generator
from studies.validation.hearts.hearts import SimulatedHearts, Structure
from studies.validation.hearts.recording import RecordedHeart, record_heart
from studies.validation.score import HeartAnswer, intervals, truths
from swesbi.base.arrays import FloatArray
from swesbi.draws import resampled_rows
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, residuals
from swesbi.measurement.speeds import SpeedRecording, measured_speeds
from swesbi.parameters import PHI_NAMES
from swesbi.posterior.adaptive import AdaptedDraws, adapted
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.settings import asking
from swesbi.recording.speed import NoiseComponents
from swesbi.report.tables.validation import QUANTITIES
from swesbi.seeds import generator, integer_seed
from swesbi.verdict.nulls import residuals_p_value, strip_ratios
from swesbi.verdict.verdict import Status
from swesbi.virtual.generated import Volunteer

Inference = Literal["intact", "fixed wall", "no length dependence", "wrong nuisances", "hidden scale"]
Hearts = Sequence[tuple[str, int]]
"""Letters and numbers."""
STREAM: Final = "broken on purpose"
SEED: Final = 7
LEAST_EFFECTIVE: Final = 300
KEPT_DRAWS: Final = 1000
NOISE: Final = NoiseComponents(
    CONFIG.acquisition.repeat_sd_fraction,
    CONFIG.acquisition.sample_sd_fraction,
    CONFIG.acquisition.sweep_fraction,
)
"""From which standard errors are told: a laboratory knows the noise of its recordings."""
EXACT: Final = asking(CONFIG.speed_experiments["calibrated"].exact, LEAST_EFFECTIVE)
RULE: Final = CONFIG.speed_experiments["calibrated"].misspecification
DOUBTFUL: Final = RULE.rule.doubtful_level
WRONG_SD: Final[Mapping[str, float]] = {
    "activation_onset_s": 2.0,
    "activation_duration_s": -2.0,
    "destruction_alpha": -2.0,
    "sigma_0_pa": 2.0,
}
"""Where wrong nuisance parameters are fixed: standard deviations of the prior from its centre, in log."""
SOFTENED: Final = -8.0
"""Power of the stretch by which a wall softens: at a stretch of 1.15 it is a third as stiff as at rest."""
SHAPE: Final = ("passive_ratio", "passive_middle_factor")
"""Nuisances by which a passive wall may soften where it is stretched."""


@cache
def inferences() -> Mapping[Inference, SpeedModelSettings]:
    """The shipped inference, and each of those in which one thing is broken."""
    intact = speed_case.settings("calibrated")
    physiology, nuisances = intact.prior.theta.physiology_names, intact.prior.theta.nuisances
    wrong = {
        name: getattr(nuisances, name).centre * float(np.exp(sd * getattr(nuisances, name).log_sd))
        for name, sd in WRONG_SD.items()
    }
    known = changed(intact, dict.fromkeys(physiology))
    forward_model = intact.forward_model.model_copy(update=wrong)
    return {
        "intact": intact,
        "fixed wall": changed(intact, dict.fromkeys(SHAPE)),
        "no length dependence": changed(intact, {"length_dependence": None}),
        "wrong nuisances": known.model_copy(update={"forward_model": forward_model}),
        "hidden scale": changed(intact, {"speed_scale": None}),
    }


def changed(model: SpeedModelSettings, priors: Mapping[str, None]) -> SpeedModelSettings:
    """The model with these nuisance parameters fixed at their own values."""
    theta = model.prior.theta
    nuisances = theta.nuisances.model_copy(update=dict(priors))
    prior = model.prior.model_copy(update={"theta": theta.model_copy(update={"nuisances": nuisances})})
    return model.model_copy(update={"prior": prior})


def own_generators() -> dict[str, Generator]:
    """Generators of the tests' own: of length dependence alone, and of walls that soften when stretched."""
    hearts = generators()["d"]
    assert isinstance(hearts, SimulatedHearts)

    def whole_length_dependence(volunteer: Volunteer, rng: np.random.Generator) -> Structure:
        return Structure({"length_dependence": 1.0})

    def softened(volunteer: Volunteer, rng: np.random.Generator) -> Structure:
        return Structure({}, passive_shape=lambda stretch: np.asarray(stretch**SOFTENED))

    return {
        "length": replace(hearts, letter="length", structure=whole_length_dependence),
        "soft": replace(hearts, letter="soft", structure=softened),
    }


@cache
def asked(letter: str, number: int, stream: str = STREAM, seed: int = SEED) -> RecordedHeart:
    """Draw and record a heart."""
    source = {**generators(), **own_generators()}[letter]
    return record_heart(source, number, seed, stream, CONFIG.recording, CONFIG.measurement.grid_points)


@cache
def answer(inference: Inference, letter: str, number: int) -> HeartAnswer:
    """The answer to a heart."""
    made = asked(letter, number)
    model = SpeedModel(measured_speeds(made.observation, NOISE), inferences()[inference])
    drawn, phi = posterior(model, inference)
    found = intervals(model, phi, EXACT.interval)
    passes = chi2_of(model, phi) >= DOUBTFUL
    return HeartAnswer(
        number, made.heart.context, made.redrawn,
        Status.NOT_CONTRADICTED if passes else Status.CONTRADICTED, "",
        by_mcmc=False, converged=drawn.reliable, efficiency=drawn.weighted.efficiency,
        truth=truths(made.heart), **vars(found),
    )  # fmt: skip


def posterior(model: SpeedModel, inference: Inference) -> tuple[AdaptedDraws, FloatArray]:
    """Weighted draws of the posterior, and equally weighted ones (n, d)."""
    subject = model.recording.subject
    drawn = adapted(HeartModel(model), EXACT, integer_seed(SEED, STREAM, inference, subject))
    rows = resampled_rows(drawn.weighted.weight, KEPT_DRAWS, generator(SEED, STREAM, inference, subject))
    return drawn, drawn.weighted.phi[rows]


def chi2_of(model: SpeedModel, phi: FloatArray) -> float:
    """Posterior predictive p-value of chi2."""
    z = residuals(model.predict(phi), model.recording, model.settings.discrepancy)
    return residuals_p_value((z**2).sum(axis=1), z.shape[1])


def answers(inference: Inference, hearts: Hearts) -> list[HeartAnswer]:
    """The answers to these hearts."""
    return [answer(inference, letter, number) for letter, number in hearts]


def covered(made: Sequence[HeartAnswer], quantity: str) -> int:
    """How many hearts have this quantity in its interval."""
    column = QUANTITIES.index(quantity)
    return sum(bool(one.covered[column]) for one in made)


def not_contradicted(made: Sequence[HeartAnswer]) -> int:
    """How many hearts are not contradicted."""
    return sum(one.not_contradicted for one in made)


def at_bounds(recording: SpeedRecording) -> tuple[float, float, float]:
    """Posterior over prior mass at all bounds, at those of what is reported; and chi2's p-value."""
    model = SpeedModel(recording, inferences()["intact"])
    drawn, phi = posterior(model, "intact")
    ratios = strip_ratios(drawn.weighted.phi, drawn.weighted.weight, model.settings.prior)
    return float(np.nanmean(ratios)), float(np.nanmean(ratios[: len(PHI_NAMES)])), chi2_of(model, phi)
