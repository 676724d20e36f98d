"""Posteriors beside others of the same recording: long Markov chains, or another network."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydantic import Field

from swesbi.artefacts import ArtefactError, save
from swesbi.base import Settings
from swesbi.checks.calibration.dataset import LOCAL_KIND, ranked_dataset, two_samples_dataset
from swesbi.checks.calibration.local import calibrate_locally, classifier_accuracy
from swesbi.checks.calibration.ranks import NETWORK, WEIGHTED
from swesbi.checks.calibration.settings import LocalSettings
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings
from swesbi.measurement.subjects import read_speed_model
from swesbi.networks.spline.files import load_spline
from swesbi.posterior.exact import ExactPosterior, read_exact_posterior
from swesbi.posterior.mcmc import sample_mcmc, starting_points
from swesbi.posterior.result import read_exact_result
from swesbi.posterior.settings import ExactSettings
from swesbi.prior import JointPriorSettings
from swesbi.seeds import generator, integer_seed
from swesbi.show.csv import write_csv
from swesbi.study.stages.origin import Origin, by_key, result_key

LOGGER = logging.getLogger("swesbi")
FloatArray = NDArray[np.float64]
LONG_CHAINS = "mcmc"


class CalibrationLocalStageSettings(Settings):
    """What local calibration depends on."""

    model: SpeedModelSettings
    exact: ExactSettings
    local: LocalSettings


def calibration_local(
    *,
    observation: Path,
    noise: Path,
    estimator: Path,
    posterior: Path,
    local: Path,
    settings: CalibrationLocalStageSettings,
    origin: Origin,
) -> None:
    """Rank draws of the subject's posterior given a second recording, and compare samplers pair by pair.

    Raises:
        ArtefactError: An input is no such artefact, or the posterior holds too few draws.
    """
    model, (flow, _) = read_speed_model(observation, noise, settings.model), load_spline(estimator)
    exact, sizes = read_exact_posterior(posterior), settings.local
    least = max(2 * sizes.replicates, sizes.two_sample_draws)
    if min(len(exact.phi), len(exact.npe_phi)) < least:
        raise ArtefactError(
            f"{posterior}: holds {len(exact.phi)} draws and {len(exact.npe_phi)} of the network, calibration "
            f"takes {least}; raise exact.draws, or lower calibration.local.replicates or two_sample_draws"
        )
    ranked = calibrate_locally(model, flow, exact, sizes, settings.exact, origin.seed)
    accuracy = _accuracies(model, exact, sizes, origin.seed)
    for pair, value in accuracy.items():
        LOGGER.info("%s, C2ST between %s: %.3f", model.recording.subject, pair, value)
    groups = {
        "local": ranked_dataset(ranked),
        "two_samples": two_samples_dataset(model.recording.subject, accuracy, sizes.two_sample_draws),
    }
    save(local, groups, origin.provenance(LOCAL_KIND, settings))


def _accuracies(
    model: SpeedModel, exact: ExactPosterior, sizes: LocalSettings, seed: int
) -> dict[str, float]:
    """Return the accuracy of a classifier by pair of samplers."""
    prior, count, subject = model.settings.prior, sizes.two_sample_draws, model.recording.subject
    chains = _long_chains(model, exact, sizes, seed)
    samples = {NETWORK: exact.npe_phi[:count], WEIGHTED: exact.phi[:count], LONG_CHAINS: chains}
    stream = integer_seed(seed, "calibration", "c2st", subject)
    pairs = ((NETWORK, LONG_CHAINS), (WEIGHTED, LONG_CHAINS), (NETWORK, WEIGHTED))
    return {
        f"{first} {second}": classifier_accuracy(samples[first], samples[second], prior, stream)
        for first, second in pairs
    }


def _long_chains(model: SpeedModel, exact: ExactPosterior, sizes: LocalSettings, seed: int) -> FloatArray:
    """Return draws (n, 4) of long chains; NaN where these did not converge, which compares with nothing."""
    count, subject = sizes.two_sample_draws, model.recording.subject
    rng = generator(seed, "calibration", "mcmc", subject)
    start = starting_points(model, exact.weighted, sizes.mcmc.start_points, rng)
    stream = integer_seed(seed, "calibration", "mcmc", subject)
    chains = sample_mcmc(model, start, sizes.mcmc, stream)
    LOGGER.info(
        "%s: %d steps of MCMC, R-hat at most %.4f, %.0f effective draws",
        subject, chains.steps, chains.r_hat.max(), chains.effective_draws.min(),
    )  # fmt: skip
    if chains.converged:
        return chains.thinned(count, rng)
    LOGGER.warning("%s: the long chains did not converge; raise calibration.local.mcmc.max_steps", subject)
    return np.full((count, exact.phi.shape[1]), np.nan)


class PopulationAgreementStageSettings(Settings):
    """What the comparison depends on."""

    prior: JointPriorSettings
    draws: int = Field(ge=50, description="draws of each sample that a classifier sees")


def population_agreement(
    *,
    posteriors: Sequence[Path],
    base_posteriors: Sequence[Path],
    table: Path,
    settings: PopulationAgreementStageSettings,
    origin: Origin,
) -> None:
    """Let a classifier tell the draws for each subject from the exact ones of the base experiment.

    Args:
        posteriors: Posteriors of the experiment over a population.
        base_posteriors: Posteriors of its base, of the same subjects.
        table: Output, accuracies of the network's own draws ("npe") and of the exact ones ("weighted").

    Raises:
        ArtefactError: An input is no such artefact.
    """
    base = {key.subject: path for key, path in by_key(base_posteriors).items()}
    rows = []
    for path in posteriors:
        subject = result_key(path).subject
        result, exact = read_exact_result(path), read_exact_result(base[subject]).phi[: settings.draws]
        for sampler, phi in ((NETWORK, result.npe_phi), (WEIGHTED, result.phi)):
            seed = integer_seed(origin.seed, "population agreement", subject, sampler)
            accuracy = classifier_accuracy(phi[: settings.draws], exact, settings.prior, seed)
            rows.append({"subject": subject, "sampler": sampler, "draws": len(exact), "c2st": accuracy})
            LOGGER.info("subject %s, %s: C2ST %.3f", subject, sampler, accuracy)
    write_csv(table, pd.DataFrame(rows))
