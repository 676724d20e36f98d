"""A small study of two recordings made with the real simulator, up to the posterior, for the stages after it.

Subject A's recording has only acquisition noise on a known theta; E's theta lies beyond the prior.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from forward_model_cases import COHORT, CONFIG
from numpy.typing import NDArray

from swesbi.artefacts import Provenance
from swesbi.checks import predictive_features, reference_fit
from swesbi.checks.settings import CmaesSettings, PredictiveSettings
from swesbi.config.read import read_merged
from swesbi.heart.prior_simulations import PriorSimulations, draw_simulations
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import simulate
from swesbi.measurement.likelihood import MeasuredSubject
from swesbi.measurement.operator import PassiveBaseline, calibrate_passive
from swesbi.measurement.settings import MeasurementSettings, PassiveSettings, SummarySettings
from swesbi.networks.settings import ObservationModelSettings
from swesbi.posterior.settings import PosteriorSettings
from swesbi.posterior.truncated import Posterior, summarise_posterior
from swesbi.prior import PriorSettings, log_centre
from swesbi.recording.observation import Observation
from swesbi.recording.phases import sample_cycle
from swesbi.recording.samples import REASONS
from swesbi.recording.speed import NoiseComponents
from swesbi.verdict.prior_support import diagnose
from swesbi.verdict.settings import SupportSettings
from swesbi.verdict.verdict import Verdict

FloatArray = NDArray[np.float64]
PLAIN: dict[str, Any] = read_merged(CONFIG)
PAPER = PLAIN["experiments"]["paper"]
FORWARD_MODEL = ForwardModelSettings.from_plain(PLAIN["forward_model"])
MEASUREMENT = MeasurementSettings.from_plain(PLAIN["measurement"])
PASSIVE = PassiveSettings.from_plain(PLAIN["passive"])
PRIOR = PriorSettings.from_plain(PLAIN["priors"]["paper"])
TRUE_THETA = {"A": (58.0, 6.0, 28.0), "E": (58.0, 38.0, 30.0)}
SEED = 7
PRIOR_DRAWS = 40
EXPERIMENT = "paper"
SUMMARY = SummarySettings.from_plain(PAPER["summary"])
PREDICTIVE = {
    "predictive": PredictiveSettings.from_plain(PAPER["predictive"] | {"draws": PRIOR_DRAWS}),
    "forward_model": FORWARD_MODEL,
    "measurement": MEASUREMENT,
    "summary": SUMMARY,
    "observation_model": ObservationModelSettings.from_plain(PAPER["observation_model"]),
    "seed": SEED,
}
CMAES = {
    "search": CmaesSettings.from_plain(
        PLAIN["cmaes"]["search"] | {"seeds": [200, 201], "population_size": 8, "generations": 25}
    ),
    "cmaes_prior": PRIOR,
    "forward_model": FORWARD_MODEL,
    "measurement": MEASUREMENT,
}


@dataclass(frozen=True)
class Files:
    """Where the results of one subject lie under a study's results."""

    results: Path
    subject: str

    @property
    def folder(self) -> Path:
        return self.results / EXPERIMENT / "subjects" / self.subject

    @property
    def observation(self) -> Path:
        return self.results / "cohort" / self.subject / "observation.h5"

    @property
    def passive(self) -> Path:
        return self.results / "cohort" / self.subject / "passive.h5"

    @property
    def shard(self) -> Path:
        return self.results / "simulations" / "paper" / self.subject / "shard-0.h5"

    @property
    def cmaes(self) -> Path:
        return self.results / "cmaes" / f"{self.subject}.h5"


def make_model(subject: str, noise_fraction: float = 0.027) -> MeasuredSubject:
    """The subject's true curve, its 20 phases read with relative noise on the speed, one phase missing."""
    context = COHORT[subject]
    reference = simulate(log_centre(PRIOR)[None], context, FORWARD_MODEL)
    truth = simulate(np.array([TRUE_THETA[subject]]), context, FORWARD_MODEL)
    phase = (np.arange(20) + 0.4) / 20.0
    rng = np.random.default_rng(3)
    active = sample_cycle(truth.cycle_phase, truth.active_stiffness_kpa, phase)[0]
    factor = 1.0 + noise_fraction * rng.standard_normal(phase.size)
    stiffness = (4.5 + active) * factor**2
    stiffness[12] = np.nan
    observation = _observation(subject, phase, stiffness, noise_fraction)
    passive = calibrate_passive(observation, reference, PASSIVE, MEASUREMENT)
    return MeasuredSubject(observation, passive, MEASUREMENT)


def _observation(
    subject: str, phase: FloatArray, stiffness: FloatArray, noise_fraction: float
) -> Observation:
    measured = np.isfinite(stiffness)
    speed = np.sqrt(stiffness / 3.0)
    return Observation(
        context=COHORT[subject],
        phase=phase,
        phase_index=np.arange(phase.size),
        cell=np.arange(phase.size),
        measured=measured,
        speed_m_s=speed,
        speed_se_m_s=noise_fraction * speed,
        stiffness_kpa=stiffness,
        stiffness_se_kpa=2.0 * noise_fraction * stiffness,
        samples_accepted=np.where(measured, 36, 0),
        samples_by_repeat=np.where(measured[:, None], (12, 12, 12), 0),
        samples_rejected=np.zeros((len(REASONS), phase.size), dtype=np.int64),
        noise=NoiseComponents(0.04, 0.08),
        grid_points=MEASUREMENT.grid_points,
    )


def write_study(results: Path) -> dict[str, Files]:
    """Write everything before the predictive stage, and return where it lies."""
    return {subject: _write_subject(Files(results, subject)) for subject in TRUE_THETA}


def _write_subject(files: Files) -> Files:
    made, model = Provenance("", files.subject, SEED, {"a": 1}, "c"), make_model(files.subject)
    model.observation.write(files.observation, made)
    model.passive.write(files.passive, made)
    context = model.observation.context
    draw_simulations(range(PRIOR_DRAWS), context, PRIOR, FORWARD_MODEL, SEED).write(files.shard, made)
    _write_posterior(files, made)
    return files


def _write_posterior(files: Files, made: Provenance) -> None:
    """A posterior about the truth, k_0 against k_ATP at -0.85, judged by the real criteria."""
    z = np.random.default_rng(5).multivariate_normal(
        np.zeros(3), [[1.0, -0.85, 0.1], [-0.85, 1.0, 0.0], [0.1, 0.0, 1.0]], 3000
    )
    candidates = np.array(TRUE_THETA[files.subject]) * np.exp(z * [0.02, 0.03, 0.05])
    z_obs, names = np.array([0.4, -1.9]), ("maximum_kpa", "hr_bpm")
    support = SupportSettings(max_abs_z=3.0, min_in_prior_draws=1000, candidate_draws=3000)
    settings = PosteriorSettings(draws=1000, unfiltered_draws=500, interval=0.9)
    diagnose(z_obs, names, candidates, PRIOR, support).write(files.folder / "verdict.json", made)
    posterior = summarise_posterior(candidates, z_obs, names, PRIOR, settings)
    posterior.write(files.folder / "posterior.h5", made)


def run_predictive(files: Files, output: Path) -> None:
    check = predictive_features.check_of_features(
        Posterior.read(files.folder / "posterior.h5"),
        Verdict.read(files.folder / "verdict.json"),
        Observation.read(files.observation),
        PassiveBaseline.read(files.passive),
        PriorSimulations.read(files.shard),
        **PREDICTIVE,
    )
    check.write(output, Provenance("", files.subject, SEED, {"a": 1}, "c"))


def run_cmaes(files: Files, output: Path) -> None:
    subject = Observation.read(files.observation), PassiveBaseline.read(files.passive)
    fit = reference_fit.reference_fit(*subject, **CMAES)
    fit.write(output, Provenance("", files.subject, SEED, {"a": 1}, "c"))
