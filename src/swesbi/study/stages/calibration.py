"""Checks of calibration over the cohort, and posteriors beside those of long chains or another network."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydantic import Field

from swesbi.artefacts import ArtefactError, Origin, save
from swesbi.artefacts.csv import write_csv
from swesbi.base.settings import Settings
from swesbi.checks.calibration import dataset
from swesbi.checks.calibration.alarms import alarm_rows
from swesbi.checks.calibration.local import calibrate_locally, classifier_accuracy
from swesbi.checks.calibration.ranks import NETWORK, WEIGHTED, Ranked
from swesbi.checks.calibration.settings import JudgementSettings, LocalSettings
from swesbi.checks.calibration.table import LOCAL, POOLED, calibration_table
from swesbi.checks.recovery import score_recovery
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, read_speed_model
from swesbi.networks.flow.files import load_flow
from swesbi.networks.flow.flow import flow_proposal
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.mcmc import sample_mcmc, starting_points
from swesbi.posterior.result import ExactPosterior, read_exact_posterior
from swesbi.posterior.settings import ExactSettings
from swesbi.posterior.space import Space
from swesbi.prior import JointPriorSettings, PriorSettings
from swesbi.seeds import generator, integer_seed
from swesbi.study.stages.origin import by_key, result_key
from swesbi.verdict.null_recordings import read_nulls
from swesbi.verdict.settings import RuleSettings

LOGGER = logging.getLogger("swesbi")


FloatArray = NDArray[np.float64]


LONG_CHAINS = "mcmc"


class CalibrationLocalStageSettings(Settings):
    """What local calibration depends on."""

    model: SpeedModelSettings
    exact: ExactSettings
    local: LocalSettings
    with_chains: bool = Field(description="whether long chains are run and compared with")


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
    model, (flow, _) = read_speed_model(observation, noise, settings.model), load_flow(estimator)
    exact, sizes = read_exact_posterior(posterior), settings.local
    least = max(2 * sizes.replicates, sizes.two_sample_draws)
    if min(len(exact.phi), len(exact.npe_phi)) < least:
        raise ArtefactError(
            f"{posterior}: holds {len(exact.phi)} draws and {len(exact.npe_phi)} of the network, calibration "
            f"takes {least}; raise exact.draws, or lower calibration.local.replicates or two_sample_draws"
        )
    ranked = calibrate_locally(model, flow, exact, sizes, settings.exact, origin.seed)
    network = flow_proposal(flow, model.recording)
    chains = _long_chains(model, exact, network, sizes, origin.seed) if settings.with_chains else None
    accuracy = _accuracies(model, exact, chains, sizes, origin.seed)
    for pair, value in accuracy.items():
        LOGGER.info("%s, C2ST between %s: %.3f", model.recording.subject, pair, value)
    groups = {
        "local": dataset.recordings_dataset(ranked),
        "two_samples": dataset.two_samples_dataset(model.recording.subject, accuracy, sizes.two_sample_draws),
    }
    save(local, groups, origin.provenance(dataset.LOCAL_KIND, settings))


def _accuracies(
    model: SpeedModel, exact: ExactPosterior, chains: FloatArray | None, sizes: LocalSettings, seed: int
) -> dict[str, float]:
    """Return the accuracy of a classifier by pair of samplers, with long chains where there are any."""
    prior, count, subject = model.settings.prior, sizes.two_sample_draws, model.recording.subject
    samples = {NETWORK: exact.npe_phi[:count], WEIGHTED: exact.phi[:count]}
    pairs = [(NETWORK, WEIGHTED)]
    if chains is not None:
        samples[LONG_CHAINS] = chains
        pairs = [(NETWORK, LONG_CHAINS), (WEIGHTED, LONG_CHAINS), *pairs]
    stream = integer_seed(seed, "calibration", "c2st", subject)
    return {
        f"{first} {second}": classifier_accuracy(samples[first], samples[second], prior, stream)
        for first, second in pairs
    }


def _long_chains(
    model: SpeedModel, exact: ExactPosterior, space: Space, sizes: LocalSettings, seed: int
) -> FloatArray:
    """Return draws (n, d) of long chains; NaN where these did not converge, which compares with nothing."""
    count, subject = sizes.two_sample_draws, model.recording.subject
    rng = generator(seed, "calibration", "mcmc", subject)
    heart = HeartModel(model)
    start = starting_points(heart, exact.weighted, sizes.mcmc.start_points, rng)
    stream = integer_seed(seed, "calibration", "mcmc", subject)
    chains = sample_mcmc(heart, start, sizes.mcmc, stream, space=space)
    LOGGER.info(
        "%s: %d steps of MCMC, R-hat at most %.4f, %.0f effective draws",
        subject, chains.steps, chains.r_hat.max(), chains.effective_draws.min(),
    )  # fmt: skip
    if chains.converged:
        return heart.evaluated(chains.thinned(count, rng)).phi
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
        result, exact = read_exact_posterior(path), read_exact_posterior(base[subject]).phi[: settings.draws]
        for sampler, phi in ((NETWORK, result.npe_phi), (WEIGHTED, result.phi)):
            seed = integer_seed(origin.seed, "population agreement", subject, sampler)
            accuracy = classifier_accuracy(phi[: settings.draws], exact, settings.prior, seed)
            rows.append({"subject": subject, "sampler": sampler, "draws": len(exact), "c2st": accuracy})
            LOGGER.info("subject %s, %s: C2ST %.3f", subject, sampler, accuracy)
    write_csv(table, pd.DataFrame(rows))


class CalibrationStageSettings(Settings):
    """What is required of the posteriors, and the prior that contraction is taken against."""

    prior: PriorSettings
    judgement: JudgementSettings
    rule: RuleSettings


def calibration(
    *,
    recordings: Sequence[Path],
    local_parts: Sequence[Path],
    null: Path,
    calibration: Path,
    table: Path,
    alarms: Path,
    recovery: Path,
    recovery_acquisition: Path,
    settings: CalibrationStageSettings,
    origin: Origin,
) -> None:
    """Join the subjects' recordings of known parameters and judge the calibration of the whole cohort.

    Both recoveries score the exact (weighted) posterior, the one that is reported, over all recordings of
    the cohort, none left out; coverage of the network's own draws is in the table beside it.

    Args:
        recordings: Recordings of known parameters, one file a subject.
        local_parts: Calibration at each subject's own data.
        null: Null recordings, among which those of known parameters are judged.
        calibration: Output, all of them together.
        table: Output, one row a check.
        alarms: Output, how often the tests of the verdict raise an alarm.
        recovery: Output, coverage under the model's own noise.
        recovery_acquisition: Output, coverage of recordings acquired sample by sample.

    Raises:
        ArtefactError: An input is no such part.
    """
    groups = dataset.join(recordings, local_parts)
    save(calibration, groups, origin.provenance(dataset.KIND, settings))
    ranked = {name: dataset.ranked_of(groups[name]) for name in ("own", "acquired", LOCAL)}
    checks = calibration_table(ranked, groups["two_samples"], settings.judgement)
    write_csv(table, checks)
    seen = {name: dataset.checks_of(groups[name]) for name in dataset.RECORDINGS}
    rows = [asdict(row) for row in alarm_rows(seen, read_nulls(null).gated, settings.rule)]
    write_csv(alarms, pd.DataFrame(rows), float_format=None)
    for path, name in ((recovery, "own"), (recovery_acquisition, "acquired")):
        _write_recovery(path, ranked[name], settings)
    _report(checks)


def _write_recovery(path: Path, ranked: Ranked, settings: CalibrationStageSettings) -> None:
    rows = score_recovery(ranked.recovered(), settings.prior, settings.judgement)
    write_csv(path, pd.DataFrame([asdict(row) for row in rows]), float_format=None)


def _report(checks: pd.DataFrame) -> None:
    pooled = checks[checks["subject"] == POOLED]
    for row in pooled[pooled["flagged"] == 1].itertuples():
        LOGGER.info("flagged: %s %s, %s recordings: %s", row.test, row.quantity, row.recordings, row.sampler)
    LOGGER.info("%d of %d checks flagged, %d of them pooled", checks["flagged"].sum(), len(checks),
                pooled["flagged"].sum())  # fmt: skip
