"""Predictive checks of an experiment on features: curves, and the paper's noise put back on them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.checks.observed_curves import at_phases, observed_curves
from swesbi.checks.predictive import (
    CheckedFeatures,
    Draws,
    PredictiveCheck,
    Replicates,
    Target,
    log_scores,
    predict,
)
from swesbi.checks.settings import PredictiveSettings
from swesbi.heart.model import activation_duration_s, isometric_stiffness_kpa
from swesbi.heart.periodic import Status
from swesbi.heart.prior_simulations import PriorSimulations
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import simulate
from swesbi.measurement.likelihood import MeasuredSubject
from swesbi.measurement.operator import PassiveBaseline
from swesbi.measurement.settings import MeasurementSettings, SummarySettings, summary_names
from swesbi.networks.paper.pool import noise_sd
from swesbi.networks.settings import ObservationModelSettings
from swesbi.posterior.truncated import Posterior
from swesbi.recording.observation import Observation
from swesbi.seeds import generator
from swesbi.verdict.verdict import Verdict


@dataclass(frozen=True)
class FeatureModel:
    """One subject under an experiment on features: it makes predictive draws of it."""

    subject: MeasuredSubject
    forward_model: ForwardModelSettings
    features: CheckedFeatures

    def from_prior(self, simulations: PriorSimulations, number: int) -> Draws:
        """Return the first ``number`` stored, successful prior simulations as predictive draws."""
        volumes = (simulations.end_diastolic_volume_ml[:number], simulations.end_systolic_volume_ml[:number])
        cycles = (simulations.cycle_phase, simulations.active_stiffness_kpa[:number])
        return self._draws(simulations.theta[:number], cycles, volumes)

    def from_theta(self, theta: FloatArray) -> Draws:
        """Simulate theta (n, 3), n > 0, and return the successful ones as predictive draws."""
        beats = simulate(theta, self.subject.observation.context, self.forward_model)
        good = beats.status == Status.PERIODIC
        cycles = (beats.cycle_phase, beats.active_stiffness_kpa[good])
        volumes = (beats.end_diastolic_volume_ml[good], beats.end_systolic_volume_ml[good])
        return self._draws(theta[good], cycles, volumes, int((~good).sum()))

    def _draws(
        self,
        theta: FloatArray,
        cycles: tuple[FloatArray, FloatArray],
        volumes_ml: tuple[FloatArray, FloatArray],
        failed: int = 0,
    ) -> Draws:
        grid = self.subject.on_grid(*cycles)
        duration_s = activation_duration_s(self.subject.observation.context.period_s, self.forward_model)
        return Draws(
            theta,
            curve_kpa=grid,
            phase_kpa=self.subject.at_phases(*cycles),
            features=self.features.of(grid),
            end_diastolic_volume_ml=volumes_ml[0],
            end_systolic_volume_ml=volumes_ml[1],
            isometric_stiffness_kpa=isometric_stiffness_kpa(theta, duration_s),
            failed=failed,
        )


def replicates(
    draws: Draws, target: Target, feature_noise_sd: Mapping[str, float], seed: int, subject: str, of: str
) -> Replicates:
    """Return n draws as new observations under the observation model (paper, Eq. 5) show them.

    Two noises move whole curves (:mod:`swesbi.checks.observed_curves`); what they do at a phase of the
    recording is read off the grid, and added to the draw's value there. Features have theirs by Eq. 5. The
    noise of the measurement alone is Gaussian, of the recording's standard errors.

    Args:
        draws: Simulations.
        target: The recording.
        feature_noise_sd: Standard deviations by feature, of which some scale and shift curves.
        seed: The study's seed.
        subject: Whose recording it is.
        of: "prior" or "posterior"; names the streams of the noise.
    """
    of_curves = generator(seed, "observed curves", subject, of)
    rng = generator(seed, "predictive", subject, of)
    curves = observed_curves(draws.curve_kpa, feature_noise_sd, of_curves)
    features = draws.features + rng.standard_normal(draws.features.shape) * target.feature_noise_sd
    measured_kpa = np.full(draws.phase_kpa.shape, np.nan)
    shown = draws.phase_kpa[:, target.measured]
    noise = rng.standard_normal(shown.shape) * target.stiffness_se_kpa[target.measured]
    measured_kpa[:, target.measured] = shown + noise
    return Replicates(
        draws,
        curve_kpa=curves,
        phase_kpa=draws.phase_kpa + at_phases(curves - draws.curve_kpa, target.phase),
        features=features,
        measured_kpa=measured_kpa,
    )


def check_of_features(
    posterior: Posterior,
    verdict: Verdict,
    observation: Observation,
    passive: PassiveBaseline,
    shards: PriorSimulations,
    *,
    predictive: PredictiveSettings,
    forward_model: ForwardModelSettings,
    measurement: MeasurementSettings,
    summary: SummarySettings,
    observation_model: ObservationModelSettings,
    seed: int,
) -> PredictiveCheck:
    """Check the predictions of one subject; a subject outside the prior's support has no posterior.

    The noise that the observation model puts back on curves has a stream of its own.

    Args:
        posterior: Of the subject.
        verdict: Whether it may be read.
        observation: The recording.
        passive: Its passive baseline.
        shards: Simulations of the subject's prior.
        predictive: So many draws are taken of prior and posterior as it says.
        forward_model: Of the simulations.
        measurement: The measurement operator.
        summary: Which features.
        observation_model: The noise of features.
        seed: Of the noise.
    """
    features = CheckedFeatures(predictive.features, summary)
    subject = MeasuredSubject(observation, passive, measurement)
    model, noise = FeatureModel(subject, forward_model, features), observation_model.feature_noise_sd
    sd = noise_sd(summary_names(summary), noise)
    target = features.target(observation, observation.stiffness_se_kpa, sd[features.columns])
    before, none = model.from_prior(shards, predictive.draws), model.from_prior(shards, 0)
    after = model.from_theta(posterior.theta[: predictive.draws]) if verdict.may_be_read else none
    prior, found = (
        predict(
            replicates(draws, target, noise, seed, observation.subject, of),
            target,
            predictive.interval,
            of_new=False,
        )
        for of, draws in (("prior", before), ("posterior", after))
    )
    check = PredictiveCheck(target, predictive.interval, verdict.may_be_read, prior, found)
    log_scores(observation.subject, check)
    return check
