"""The paper's chain under one reading, in memory: training set, network, posteriors, predictive checks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from pydantic import Field

from studies.readings.recordings import CalibratedSubjectSettings, passive_scale_error
from studies.readings.settings import Treatment
from studies.readings.treatment import Features
from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.checks.draws import CheckedFeatures
from swesbi.checks.observed_curves import observed_curves
from swesbi.checks.predictive import noise_streams
from swesbi.checks.scores import band, check_features, coverage, reduction_percent, score
from swesbi.checks.settings import CheckpointEpochs, PredictiveSettings, RecoverySettings
from swesbi.heart.periodic import Status
from swesbi.heart.prior_simulations import PriorSimulations
from swesbi.heart.simulate import simulate
from swesbi.measurement.likelihood import MeasuredSubject
from swesbi.measurement.operator import total_cycle
from swesbi.measurement.settings import (
    SummarySettings,
    summary_names,
    summary_units,
)
from swesbi.networks.paper.estimator import Checkpoint
from swesbi.networks.paper.maf import MaskedFlow, draw_until
from swesbi.networks.paper.pool import Pool, SubjectFeatures, build_pool, components_of, noise_sd
from swesbi.networks.paper.training import train
from swesbi.networks.settings import EstimatorSettings, ObservationModelSettings
from swesbi.parameters import THETA_NAMES
from swesbi.posterior.settings import PosteriorSettings
from swesbi.posterior.truncated import Posterior, summarise_posterior
from swesbi.prior import PriorSettings
from swesbi.recording.phases import sample_cycle, to_grid
from swesbi.seeds import generator, integer_seed
from swesbi.verdict.prior_support import diagnose
from swesbi.verdict.settings import SupportSettings
from swesbi.verdict.verdict import Verdict

RECOVERY: Final = "recovery_coverage"
CORRELATION: Final = "r"
SUPPORTED: Final = "supported"
RMSE: Final = "rmse_kpa"


class ChainSettings(CalibratedSubjectSettings):
    """What the chain depends on: the settings of an experiment of the paper's kind, and of its recordings."""

    simulations_per_subject: int = Field(ge=1, description="the first so many draws of each subject")
    prior: PriorSettings
    summary: SummarySettings
    observation_model: ObservationModelSettings
    estimator: EstimatorSettings
    checkpoint_epochs: CheckpointEpochs
    support: SupportSettings
    posterior: PosteriorSettings
    predictive: PredictiveSettings
    recovery: RecoverySettings


@dataclass(frozen=True)
class Row:
    """One number of a reading.

    Attributes:
        quantity: What it is, with its unit unless it is dimensionless.
        of: The subject, or the parameters, that it is of.
        epoch: After how many epochs of training.
        value: The number.
    """

    quantity: str
    of: str
    epoch: int
    value: float


@dataclass(frozen=True)
class Case:
    """One subject with its recording and its simulations from the prior."""

    subject: MeasuredSubject
    simulations: PriorSimulations

    @property
    def name(self) -> str:
        """The subject's name."""
        return self.subject.observation.subject

    @property
    def prior_curves(self) -> FloatArray:
        """The simulated curves (n, G) as the recording shows them."""
        return self.subject.on_grid(self.simulations.cycle_phase, self.simulations.active_stiffness_kpa)


def curves_of_cycles(subject: MeasuredSubject, cycle_phase: FloatArray, total_kpa: FloatArray) -> FloatArray:
    """Return cycles (n, M) of total stiffness on the grid (n, G), through the recording's measured phases."""
    phase = subject.observation.measured_phase
    return to_grid(phase, sample_cycle(cycle_phase, total_kpa, phase), subject.measurement.grid_points)


def reading_pool(cases: Sequence[Case], features: Features, chain: ChainSettings, seed: int) -> Pool:
    """Return the training set of a reading; without noise on whole curves, made as that of the study is."""
    model = chain.observation_model
    if features.treatment.curve_noise:
        model = model.model_copy(update={"feature_noise_sd": features.on_features, "augmentations": 1})
    components = components_of(summary_names(chain.summary), summary_units(chain.summary))
    return build_pool([_of_case(case, features, chain, seed) for case in cases], components, model, seed)


def _of_case(case: Case, features: Features, chain: ChainSettings, seed: int) -> SubjectFeatures:
    wanted = chain.simulations_per_subject
    curves = case.prior_curves[:wanted]
    copies = chain.observation_model.augmentations if features.treatment.curve_noise else 1
    rng = generator(seed, "readings", "curve noise", case.name)
    return SubjectFeatures(
        context=case.subject.observation.context,
        draw_index=np.repeat(case.simulations.draw_index[:wanted], copies),
        theta=np.repeat(case.simulations.theta[:wanted], copies, axis=0),
        features=features.observed(np.repeat(curves, copies, axis=0), rng),
        observed=features.of(case.subject.observation.curve_kpa[None])[0],
    )


def train_reading(pool: Pool, chain: ChainSettings, seed: int, label: str) -> tuple[Checkpoint, ...]:
    """Train on the pool as the study does; return the network after the epochs asked for, best and last."""
    names = pool.components.names
    result = train(
        pool.theta,
        pool.z,
        names,
        chain.prior,
        chain.estimator,
        integer_seed(seed, "training"),
        "cpu",
        label,
        chain.checkpoint_epochs,
    )
    best = result.estimator.best_epoch
    return tuple(
        Checkpoint(
            epoch=epoch,
            validation_loss=loss,
            best=epoch == best,
            components=names,
            net=MaskedFlow(chain.estimator, len(THETA_NAMES), len(names), state),
        )
        for epoch, loss, state in result.weights
    )


def chosen(nets: Sequence[Checkpoint], treatment: Treatment) -> Checkpoint:
    """Return the network of the best epoch, or of the last."""
    if treatment.epoch == "last":
        return max(nets, key=lambda net: net.epoch)
    return next(net for net in nets if net.best)


def answer(
    case: Case, pool: Pool, net: Checkpoint, features: Features, chain: ChainSettings, seed: int
) -> Iterator[Row]:
    """Yield what the paper prints of one subject: support, scores, features, correlations."""
    verdict, posterior = _infer(case, pool, net, chain, seed)

    def row(quantity: str, value: float, of: str = case.name) -> Row:
        return Row(quantity, of, net.epoch, float(value))

    grid, observed = case.subject.observation.grid, case.subject.observation.curve_kpa
    interval, draws = chain.predictive.interval, chain.predictive.draws
    prior = score(grid, observed, band(case.prior_curves[:draws], interval))
    yield row(SUPPORTED, verdict.may_be_read)
    yield row("max_abs_z", verdict.max_abs_z)
    yield row("in_prior_share", verdict.acceptance)
    yield row("rmse_prior_kpa", prior.rmse_kpa)
    if not verdict.may_be_read:
        return
    curves = predictive_curves(case.subject, posterior.theta[:draws], features.treatment, chain, seed)
    scores = score(grid, observed, band(curves, interval))
    noise = chain.observation_model.feature_noise_sd
    again = observed_curves(curves, noise, noise_streams(seed, case.name, "posterior")[0])
    yield row(RMSE, scores.rmse_kpa)
    yield row("rmse_reduction_percent", reduction_percent(prior.rmse_kpa, scores.rmse_kpa))
    yield row("nrmse", scores.nrmse)
    yield row("r2", scores.r2)
    yield row("post_peak_rmse_kpa", scores.post_peak_rmse_kpa)
    yield row("coverage_curve", scores.coverage)
    yield row("coverage_observed", coverage(observed, band(again, interval)))
    inside = _features_inside(case, curves, features, chain, seed)
    yield row("features_inside", inside.sum())
    yield row("all_features_inside", float(inside.all()))
    for first, second in ((0, 1), (0, 2), (1, 2)):
        pair = f"{THETA_NAMES[first]} {THETA_NAMES[second]}"
        yield row(CORRELATION, posterior.correlation[first, second], f"{case.name} {pair}")


def _infer(
    case: Case, pool: Pool, net: Checkpoint, chain: ChainSettings, seed: int
) -> tuple[Verdict, Posterior]:
    """Draw candidates until those that the posterior keeps are there; they are the first of the study's."""
    z_obs, names = pool.observed_z(case.name), pool.components.names
    enough = max(chain.support.min_in_prior_draws, chain.posterior.draws)
    at_most = chain.support.candidate_draws
    of_subject = integer_seed(seed, "posterior", case.name)
    candidates = draw_until(net, z_obs, enough, at_most, chain.prior, of_subject)
    verdict = diagnose(z_obs, names, candidates, chain.prior, chain.support)
    return verdict, summarise_posterior(candidates, z_obs, names, chain.prior, chain.posterior)


def predictive_curves(
    subject: MeasuredSubject, theta: FloatArray, treatment: Treatment, chain: ChainSettings, seed: int
) -> FloatArray:
    """Return the curves (m, G) of theta (n, 3), m of which succeed, the passive scale drawn if asked for."""
    beats = simulate(theta, subject.observation.context, chain.forward_model)
    good = beats.status == Status.PERIODIC
    cycles = (beats.cycle_phase, beats.active_stiffness_kpa[good])
    if treatment.passive_scale_errors == 0.0:
        return subject.on_grid(*cycles)
    sd = treatment.passive_scale_errors * passive_scale_error(
        subject.observation, subject.passive, chain.passive
    )
    rng = generator(seed, "readings", "passive scale", subject.observation.subject)
    factor = np.maximum(1.0 + sd * rng.standard_normal(int(good.sum())), 0.0)
    total = total_cycle(cycles, subject.passive, subject.measurement)
    total = total + (factor - 1.0)[:, None] * subject.passive.stiffness_kpa
    return curves_of_cycles(subject, beats.cycle_phase, total)


def _features_inside(
    case: Case, curves: FloatArray, features: Features, chain: ChainSettings, seed: int
) -> BoolArray:
    """Return which of the checked features lie in their intervals, noise included."""
    names = chain.predictive.features
    columns = CheckedFeatures(names, chain.summary).columns
    sd = noise_sd(summary_names(chain.summary), features.on_features)[columns]
    noisy = features.observed(curves, generator(seed, "readings", "feature check", case.name))
    observed = features.of(case.subject.observation.curve_kpa[None])[0]
    _, rng = noise_streams(seed, case.name, "posterior")
    check = check_features(observed[columns], noisy[:, columns], sd, chain.predictive.interval, rng)
    return check.inside
