"""Exact posteriors: of one subject, of the cohort under a variant, of recordings of known parameters."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from swesbi.artefacts import load, save
from swesbi.base import Settings
from swesbi.checks.calibration.dataset import RECORDINGS_KIND, inferred_dataset
from swesbi.checks.calibration.ranks import Inferred
from swesbi.checks.calibration.recordings import infer_recordings
from swesbi.checks.calibration.settings import RecordingsSettings
from swesbi.checks.sensitivity import KIND, VariantPosterior, to_dataset
from swesbi.measurement import likelihood
from swesbi.measurement.operator import KIND as PASSIVE
from swesbi.measurement.operator import read_passive
from swesbi.measurement.speeds import measured_speeds
from swesbi.networks.spline.files import load_spline
from swesbi.networks.spline.flow import FlowProposal, TrainedSpline, flow_proposal
from swesbi.networks.spline.pool import SubjectSimulations, at_phases
from swesbi.parameters import REPORTED, SCALE
from swesbi.population.synthetic import Acquisition, acquired_recordings, own_recordings
from swesbi.posterior import exact as posteriors
from swesbi.posterior.exact import ExactPosterior, exact_to_groups
from swesbi.posterior.mcmc import sample_mcmc
from swesbi.posterior.settings import ExactSettings
from swesbi.posterior.truncated import POSTERIOR
from swesbi.prior import ParameterPrior, quantile
from swesbi.recording.noise import read_noise
from swesbi.recording.observation import Observation, read_observation
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.seeds import generator, integer_seed
from swesbi.simulations import draw_simulations
from swesbi.study.stages.flow_training import TrainFlowStageSettings
from swesbi.study.stages.origin import Origin
from swesbi.virtual_cohort.settings import AcquisitionSettings

LOGGER = logging.getLogger("swesbi")
FIXED_LOG_SD: Final = 1e-3  # a passive scale taken for granted: a prior of no width to speak of
FIXED_BOUNDS: Final = (0.99, 1.01)
STREAM = "calibration"


class ExactPosteriorStageSettings(Settings):
    """What the exact posterior depends on."""

    model: likelihood.SpeedModelSettings
    exact: ExactSettings


def exact_posterior(
    *,
    observation: Path,
    noise: Path,
    estimator: Path,
    posterior: Path,
    settings: ExactPosteriorStageSettings,
    origin: Origin,
) -> None:
    """Weight the network's draws with the simulator; where the weights fail, sample by MCMC.

    A sampler that does not converge leaves its draws and says so, in the artefact and in the log.

    Raises:
        ArtefactError: An input is no such artefact.
        NoLikelihoodError: Every simulation fails.
    """
    model, (flow, _) = likelihood.read_speed_model(observation, noise, settings.model), load_spline(estimator)
    proposal = flow_proposal(flow, model.recording)
    exact, efficiency = posteriors.exact_posterior(
        model, proposal, settings.exact, origin.seed, "exact", model.recording.subject
    )
    rounds = ", ".join(f"{share:.0%}" for share in efficiency)
    LOGGER.info("efficiency of the network, and of all draws after each further round: %s", rounds)
    write_posterior(posterior, exact, proposal, settings, origin)


def write_posterior(
    path: Path,
    exact: ExactPosterior,
    proposal: FlowProposal | None,
    settings: ExactPosteriorStageSettings,
    origin: Origin,
) -> None:
    """Write an exact posterior, with the conditioning vector of a network if there was one, and log it."""
    condition = np.empty(0) if proposal is None else proposal.condition
    components = () if proposal is None else proposal.flow.components
    groups = exact_to_groups(exact, condition, components, settings.model.prior, settings.exact)
    save(path, groups, origin.provenance(POSTERIOR, settings))
    _report(origin.subject, exact)


def _report(subject: str, exact: ExactPosterior) -> None:
    LOGGER.info(
        "subject %s: draws by %s; k-hat %.2f, efficiency %.0f %%",
        subject, exact.sampler, exact.k_hat, 100.0 * exact.efficiency,
    )  # fmt: skip
    level = logging.INFO if exact.converged else logging.WARNING
    for reason in exact.reasons:
        LOGGER.log(level, "  %s", reason)


class SensitivityRunStageSettings(Settings):
    """What the posteriors of a variant depend on: the changed configuration, its seed among it."""

    seed: int
    simulations_per_subject: int
    train: TrainFlowStageSettings
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
    from swesbi.networks.spline.training import train_spline  # torch, of which the other stages need nothing

    models = likelihood.read_speed_models(observations, noise, settings.train.model)
    simulated = [_simulations(model, settings) for model in models]
    seed = integer_seed(settings.seed, "flow training")
    label = f"variant {posteriors.stem}"
    flow = train_spline(simulated, settings.train.conditioning, settings.train.estimator, seed, label).spline
    scales = {load(path, PASSIVE)[1].subject: read_passive(path).scale_kpa for path in passives}
    inferred = [_infer(model, flow, scales, settings) for model in models]
    save(posteriors, to_dataset(inferred), origin.provenance(KIND, settings))
    for posterior in inferred:
        subject, efficiency = posterior.subject, posterior.efficiency
        LOGGER.info("%s, subject %s: %s, efficiency %.2f", label, subject, posterior.sampler, efficiency)


def _simulations(model: likelihood.SpeedModel, settings: SensitivityRunStageSettings) -> SubjectSimulations:
    prior, context = model.settings.prior.theta, model.recording.context
    draws = range(settings.simulations_per_subject)
    return at_phases(
        draw_simulations(draws, context, prior, model.settings.forward_model, settings.seed), model
    )


def _infer(
    model: likelihood.SpeedModel,
    flow: TrainedSpline,
    scales: dict[str, float],
    settings: SensitivityRunStageSettings,
) -> VariantPosterior:
    subject = model.recording.subject
    if settings.fix_passive_scale:
        return _with_fixed_scale(model, flow, scales[subject], settings)
    proposal = flow_proposal(flow, model.recording)
    exact, _ = posteriors.exact_posterior(model, proposal, settings.exact, settings.seed, "exact", subject)
    by_mcmc = exact.sampler == "mcmc"
    phi = exact.phi[:, REPORTED]
    return VariantPosterior(subject, phi, by_mcmc, exact.k_hat, exact.efficiency, exact.converged)


def _with_fixed_scale(
    model: likelihood.SpeedModel, flow: TrainedSpline, scale_kpa: float, settings: SensitivityRunStageSettings
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
    phi = sampled.thinned(settings.exact.draws, rng)[:, REPORTED]
    return VariantPosterior(subject, phi, True, float("nan"), float("nan"), sampled.converged)


class CalibrationRecordingsStageSettings(Settings):
    """What the recordings and their posteriors depend on."""

    model: likelihood.SpeedModelSettings
    exact: ExactSettings
    acquisition: AcquisitionSettings
    recording: RecordingSettings
    recordings: RecordingsSettings


def calibration_recordings(
    *,
    observation: Path,
    noise: Path,
    estimator: Path,
    recordings: Path,
    settings: CalibrationRecordingsStageSettings,
    origin: Origin,
) -> None:
    """Make recordings in the subject's context and with its phases, and infer every one.

    Half of the runs have the model's own noise and discrepancy. The others start from the same phi but are
    acquired sample by sample, with the discrepancy drawn for each phase, pass quality control and ingestion,
    get their standard errors from the cohort's variance components and their own counts, and have their own
    phases; the passive scale is inferred with the rest. Recordings that ingestion refuses are left out, and
    the log says how many.

    Raises:
        ArtefactError: An input is no such artefact.
        ValueError: Ingestion refused every recording.
    """
    observed, components = read_observation(observation), read_noise(noise).components
    model = likelihood.speed_model(measured_speeds(observed, components), settings.model)
    flow, _ = load_spline(estimator)
    sizes, subject = settings.recordings, observed.subject
    own = own_recordings(model, sizes.own, origin.seed, STREAM)
    acquisition = _acquisition(observed, components, settings)
    acquired = acquired_recordings(model, acquisition, sizes.acquired, origin.seed, STREAM)
    LOGGER.info("%s: ingestion refused %d of %d recordings", subject, acquired.refused, sizes.acquired)
    if not len(acquired.phi):
        raise ValueError(f"subject {subject}: all {sizes.acquired} synthetic recordings were refused")
    groups = {}
    for name, synthetic in (("own", own), ("acquired", acquired)):
        inferred = infer_recordings(model, synthetic, flow, sizes, settings.exact, origin.seed, name)
        LOGGER.info("%s, %s: %s", subject, name, _account(inferred))
        groups[name] = inferred_dataset(inferred)
    save(recordings, groups, origin.provenance(RECORDINGS_KIND, settings))


def _acquisition(
    observed: Observation, noise: NoiseComponents, settings: CalibrationRecordingsStageSettings
) -> Acquisition:
    missing = tuple(int(index) for index in observed.phase_index[~observed.measured])
    measurement = settings.model.measurement
    return Acquisition(settings.acquisition, settings.recording, measurement, noise, missing)


def _account(inferred: Inferred) -> str:
    diagnostics = inferred.diagnostics
    return (
        f"efficiency {np.median(diagnostics.efficiency):.0%} (median), "
        f"k-hat at most {diagnostics.k_hat.max():.2f}, "
        f"MCMC took over in {int(diagnostics.by_mcmc.sum())} of {len(diagnostics.by_mcmc)}"
    )
