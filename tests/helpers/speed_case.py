"""A speed model made for tests: the shipped settings, one context, a recording without a file."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from study_copy import ROOT

from swesbi.config.models import Config
from swesbi.config.read import parse_config, read_merged
from swesbi.context import Context
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings
from swesbi.measurement.speeds import SpeedRecording
from swesbi.posterior.settings import ExactSettings
from swesbi.prior import log_centre
from swesbi.recording.noise.errors import mean_errors
from swesbi.recording.speed import NoiseComponents
from swesbi.verdict.settings import RuleSettings

CONTEXT = Context("T", "F", 25.0, 1.7, 66.0, 90.0, 34.0, 0.8)
PHI = np.array([60.0, 6.0, 29.0, 1.5])
RELATIVE_SE = 0.028
OF_FIXED_PHYSIOLOGY = {"speed_fraction": 0.02, "timing_cycle": 0.015}
"""The discrepancy of a model whose physiology is one for all hearts."""
SWEEPS = NoiseComponents(0.04, 0.08, 0.05)


@cache
def shipped() -> Config:
    return parse_config(read_merged(ROOT / "config.yaml"))


@cache
def settings(prior: str = "paper") -> SpeedModelSettings:
    """Return the shipped model of speeds, by default without nuisance parameters but the stiffness a."""
    config = shipped()
    experiment = config.speed_experiments["calibrated"]
    shipped_pair = experiment.observation_model.discrepancy
    plain = {
        "prior": {
            "theta": config.priors[prior].to_plain(),
            "passive_stiffness_kpa": experiment.passive_stiffness_kpa.to_plain(),
        },
        "discrepancy": OF_FIXED_PHYSIOLOGY if prior == "paper" else shipped_pair.to_plain(),
        "forward_model": config.forward_model.to_plain(),
        "measurement": config.measurement.to_plain(),
        "density_kg_m3": 1000.0,
    }
    return SpeedModelSettings.from_plain(plain)


def exact() -> ExactSettings:
    """Return the shipped sizes and criteria of exact posteriors."""
    return shipped().speed_experiments["calibrated"].exact


def rule() -> RuleSettings:
    """Return the shipped levels and tolerances of the verdict."""
    return shipped().speed_experiments["calibrated"].misspecification.rule


@cache
def model(phases: int = 20, prior: str = "paper") -> SpeedModel:
    """Return the model of a noiseless recording made with ``PHI``, nuisance parameters at their centres."""
    phase = (np.arange(phases) + 0.5) / phases
    relative_se, shared = np.full(phases, RELATIVE_SE), np.empty((phases, 0))
    blank = SpeedRecording(CONTEXT, phase, np.ones(phases), relative_se, shared)
    made = SpeedModel(blank, settings(prior))
    speeds = made.predict(central_phi(made)[None]).speed_m_s[0]
    return replace(made, recording=replace(blank, speed_m_s=speeds))


def central_phi(model: SpeedModel) -> NDArray[np.float64]:
    """Return ``PHI`` with the nuisance parameters of the model, if any, at their centres; shape (d,)."""
    return np.concatenate([PHI, log_centre(model.settings.prior)[len(PHI) :]])


@cache
def model_of_sweeps() -> SpeedModel:
    """Return the same as recorded in three sweeps, of which one missed two phases."""
    counts = np.full((20, 3), 12)
    counts[[4, 11], 1], counts[7, 2] = 0, 5
    errors, plain = mean_errors(counts, SWEEPS), model()
    return replace(plain, recording=replace(plain.recording, relative_se=errors.own, shared=errors.shared))
