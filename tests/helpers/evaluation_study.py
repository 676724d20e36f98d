"""A study of two recordings up to the posterior, by the real simulator; E's theta lies beyond the prior."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import comparison_case
import numpy as np
from forward_model_cases import COHORT
from numpy.typing import NDArray
from speed_case import shipped

from swesbi.artefacts import Provenance
from swesbi.checks import cmaes, predictive_features
from swesbi.heart.prior_simulations import PriorSimulations, draw_simulations
from swesbi.heart.simulate import simulate
from swesbi.measurement.likelihood import MeasuredSubject
from swesbi.measurement.operator import PassiveBaseline, calibrate_passive
from swesbi.posterior.truncated import Posterior, summarise_posterior
from swesbi.prior import log_centre
from swesbi.recording.noise.cohort import CohortNoise, GroupNoise, NoiseEstimate
from swesbi.recording.noise.components import ComponentEstimate
from swesbi.recording.observation import Observation
from swesbi.recording.phases import sample_cycle
from swesbi.verdict.prior_support import diagnose
from swesbi.verdict.settings import SupportSettings
from swesbi.verdict.verdict import Verdict

CONFIG = shipped()
PAPER = CONFIG.feature_experiments["paper"]
PRIOR = CONFIG.priors["paper"]
MODEL = {"forward_model": CONFIG.forward_model, "measurement": CONFIG.measurement}
TRUE_THETA = {"A": (58.0, 6.0, 28.0), "E": (58.0, 38.0, 30.0)}
SEED = 7
DRAWS = 40
NOISE_FRACTION = 0.027


def make_model(subject: str) -> MeasuredSubject:
    """The subject's true curve, its 20 phases read with relative noise on the speed, one phase missing."""
    context, phase = COHORT[subject], (np.arange(20) + 0.4) / 20.0
    reference = simulate(log_centre(PRIOR)[None], context, CONFIG.forward_model)
    truth = simulate(np.array([TRUE_THETA[subject]]), context, CONFIG.forward_model)
    active = sample_cycle(truth.cycle_phase, truth.active_stiffness_kpa, phase)[0]
    factor = 1.0 + NOISE_FRACTION * np.random.default_rng(3).standard_normal(phase.size)
    measured = np.arange(20) != 12
    stiffness = np.where(measured, (4.5 + active) * factor**2, np.nan)
    speed: NDArray[np.float64] = np.sqrt(stiffness / 3.0)
    observation = replace(
        comparison_case.observation(subject),
        context=context,
        phase=phase,
        measured=measured,
        speed_m_s=speed,
        speed_se_m_s=NOISE_FRACTION * speed,
        stiffness_kpa=stiffness,
        stiffness_se_kpa=2.0 * NOISE_FRACTION * stiffness,
    )
    passive = calibrate_passive(observation, reference, CONFIG.passive, CONFIG.measurement)
    return MeasuredSubject(observation, passive, CONFIG.measurement)


def noise_of(subjects: Iterable[str]) -> CohortNoise:
    """Return the noise of a cohort in which all have the same."""
    parts = [ComponentEstimate(size, 0.001, 0.9 * size, 1.1 * size) for size in (0.04, 0.08)]
    estimate = NoiseEstimate(*parts, repeats=60, samples=700)
    return CohortNoise({"all": GroupNoise(estimate, dict.fromkeys(subjects, estimate), 0.6)}, 0.9)


def write_study(results: Path) -> dict[str, Path]:
    """Write everything before the predictive stage, and return the folders of the subjects."""
    for subject in TRUE_THETA:
        folder, model, made = results / subject, make_model(subject), _made_of(subject)
        model.observation.write(folder / "observation.h5", made)
        model.passive.write(folder / "passive.h5", made)
        context = model.observation.context
        shard = draw_simulations(range(DRAWS), context, PRIOR, CONFIG.forward_model, SEED)
        shard.write(folder / "shard.h5", made)
        _write_posterior(folder, made)
    return {subject: results / subject for subject in TRUE_THETA}


def _made_of(subject: str) -> Provenance:
    return Provenance("", subject, SEED, {"a": 1}, "c")


def _write_posterior(folder: Path, made: Provenance) -> None:
    """A posterior about the truth, k_0 against k_ATP at -0.85, judged by the real criteria."""
    covariance = [[1.0, -0.85, 0.1], [-0.85, 1.0, 0.0], [0.1, 0.0, 1.0]]
    z = np.random.default_rng(5).multivariate_normal(np.zeros(3), covariance, 3000)
    candidates = np.array(TRUE_THETA[folder.name]) * np.exp(z * [0.02, 0.03, 0.05])
    z_obs, names = np.array([0.4, -1.9]), ("maximum_kpa", "hr_bpm")
    support = SupportSettings(max_abs_z=3.0, min_in_prior_draws=1000, candidate_draws=3000)
    diagnose(z_obs, names, candidates, PRIOR, support).write(folder / "verdict.json", made)
    settings = PAPER.posterior.model_copy(update={"draws": 1000, "unfiltered_draws": 500})
    summarise_posterior(candidates, z_obs, names, PRIOR, settings).write(folder / "posterior.h5", made)


def run_predictive(folder: Path, output: Path) -> None:
    check = predictive_features.check_of_features(
        Posterior.read(folder / "posterior.h5"),
        Verdict.read(folder / "verdict.json"),
        Observation.read(folder / "observation.h5"),
        PassiveBaseline.read(folder / "passive.h5"),
        PriorSimulations.read(folder / "shard.h5"),
        predictive=PAPER.predictive.model_copy(update={"draws": DRAWS}),
        summary=PAPER.summary,
        observation_model=PAPER.observation_model,
        seed=SEED,
        **MODEL,
    )
    check.write(output, _made_of(folder.name))


def run_cmaes(folder: Path, output: Path) -> None:
    sizes = {"seeds": (200, 201), "population_size": 8, "generations": 25}
    fit = cmaes.reference_fit(
        Observation.read(folder / "observation.h5"),
        PassiveBaseline.read(folder / "passive.h5"),
        search=CONFIG.cmaes.search.model_copy(update=sizes),
        cmaes_prior=PRIOR,
        **MODEL,
    )
    fit.write(output, _made_of(folder.name))
