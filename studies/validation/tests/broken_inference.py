"""Hearts of development, recorded as in the validation, answered without a network and with parts broken.

No trained network exists among the tests. Adaptive importance sampling, which begins with the prior, takes
its place: the posterior is the same, and what the validation scores is a posterior.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, Literal

import numpy as np
import speed_case
from other_hearts_case import CONFIG, recorded

from studies.discrepancy.evidence import fill_bank
from studies.validation.score import HeartAnswer, intervals, truths
from swesbi.base.arrays import FloatArray
from swesbi.draws import effective_draws, normalised, resampled_rows
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings
from swesbi.measurement.speeds import measured_speeds
from swesbi.recording.speed import NoiseComponents
from swesbi.report.tables.validation_outcomes import QUANTITIES, SCORED
from swesbi.seeds import generator
from swesbi.verdict.verdict import NOT_CONTRADICTED
from swesbi.virtual.hearts.recorded import RecordedHeart

Inference = Literal["intact", "reference beat", "wrong nuisances", "hidden scale"]
STREAM: Final = "broken on purpose"
SEED: Final = 7
LETTERS: Final = ("a", "b")
HEARTS: Final = 6
"""Of each letter."""
DRAWS_A_ROUND, MOST_ROUNDS, LEAST_EFFECTIVE = 2000, 20, 300
KEPT_DRAWS: Final = 1000
NOISE: Final = NoiseComponents(
    CONFIG.acquisition.repeat_sd_fraction,
    CONFIG.acquisition.sample_sd_fraction,
    CONFIG.acquisition.sweep_fraction,
)
"""From which standard errors are told: a laboratory knows the noise of its recordings."""
INTERVAL: Final = CONFIG.speed_experiments["calibrated"].exact.interval
WRONG_SD: Final[Mapping[str, float]] = {
    "activation_onset_s": 1.0,
    "activation_duration_s": -1.0,
    "destruction_alpha": -1.0,
    "sigma_0_pa": 1.0,
}
"""Where wrong nuisance parameters are fixed: standard deviations of the prior from its centre, in log."""


def inferences() -> dict[Inference, SpeedModelSettings]:
    """The shipped inference, and each of those in which one thing is broken."""
    intact = speed_case.settings("calibrated")
    physiology, nuisances = intact.prior.theta.physiology_names, intact.prior.theta.nuisances
    wrong = {
        name: getattr(nuisances, name).centre * float(np.exp(sd * getattr(nuisances, name).log_sd))
        for name, sd in WRONG_SD.items()
    }
    forward_model = intact.forward_model.model_copy(update=wrong)
    # left free, the passive stiffness in compression would take up part of what relaxation gets wrong
    known = (*physiology, "passive_compression_factor")
    return {
        "intact": intact,
        "reference beat": intact.model_copy(update={"passive_beat": "reference"}),
        "wrong nuisances": fixed(intact, known).model_copy(update={"forward_model": forward_model}),
        "hidden scale": fixed(intact, ["speed_scale"]),
    }


def fixed(model: SpeedModelSettings, names: Sequence[str]) -> SpeedModelSettings:
    """The model with nuisance parameters of these names fixed at the values of its settings."""
    theta = model.prior.theta
    nuisances = theta.nuisances.model_copy(update=dict.fromkeys(names))
    prior = model.prior.model_copy(update={"theta": theta.model_copy(update={"nuisances": nuisances})})
    return model.model_copy(update={"prior": prior})


def answers(inference: Inference) -> list[HeartAnswer]:
    """The answers to all hearts, those of (a) first."""
    settings = inferences()[inference]
    hearts = [recorded(letter, number, STREAM, SEED) for letter in LETTERS for number in range(HEARTS)]
    return [answer(number, heart, settings, inference) for number, heart in enumerate(hearts)]


def coverage(made: Sequence[HeartAnswer]) -> dict[str, float]:
    """Share of the hearts whose attained stiffness, and whose k_SR, lie in their intervals."""
    shares = np.mean([one.covered[:SCORED] for one in made], axis=0)
    return dict(zip(QUANTITIES[:SCORED], map(float, shares), strict=True))


def answer(
    number: int, made: RecordedHeart, settings: SpeedModelSettings, inference: Inference
) -> HeartAnswer:
    """The answer to a heart; without a network there is no verdict, and every heart counts."""
    model = SpeedModel(measured_speeds(made.observation, NOISE), settings)
    phi, efficiency, converged = posterior_draws(model, inference)
    found = intervals(model, phi, INTERVAL)
    return HeartAnswer(
        number, made.heart.context, made.redrawn, NOT_CONTRADICTED, "", by_mcmc=False,
        converged=converged, efficiency=efficiency, truth=truths(made.heart), **vars(found),
    )  # fmt: skip


def posterior_draws(model: SpeedModel, inference: Inference) -> tuple[FloatArray, float, bool]:
    """Equally weighted draws (n, d), the effective share of the weighted ones, whether these are enough."""
    rng = generator(SEED, STREAM, inference, model.recording.subject)
    sizes = (DRAWS_A_ROUND, MOST_ROUNDS, LEAST_EFFECTIVE)
    bank = fill_bank(model, (model.settings.discrepancy,), *sizes, rng)
    weight = normalised(bank.log_weights()[0])
    effective = effective_draws(weight)
    phi = bank.phi[resampled_rows(weight, KEPT_DRAWS, rng)]
    return phi, effective / len(weight), effective >= LEAST_EFFECTIVE
