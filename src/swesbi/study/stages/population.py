"""Answers by the network of a population: for fresh contexts, whose truth is known, and for a cohort."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pandas as pd

from swesbi.artefacts import save, write_json
from swesbi.base import Settings
from swesbi.checks.calibration.dataset import FRESH as KIND
from swesbi.checks.calibration.dataset import fresh_dataset, fresh_of
from swesbi.checks.calibration.dataset import join_fresh as join
from swesbi.checks.calibration.fresh import FreshInferred, Judge, infer_fresh
from swesbi.checks.calibration.settings import JudgementSettings, RecordingsSettings
from swesbi.checks.predictive_speeds import Recorder
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.subjects import build_speed_model
from swesbi.networks.spline.files import load_spline
from swesbi.networks.spline.net import TrainedSpline
from swesbi.population.recordings import ACQUIRED, OWN, FreshSettings
from swesbi.population.settings import StrataSettings
from swesbi.posterior.importance import flow_proposal
from swesbi.posterior.refine import refined_posterior
from swesbi.posterior.settings import ExactSettings, RefinementSettings
from swesbi.prior import PriorSettings
from swesbi.progress import Progress
from swesbi.recording.noise import read_noise
from swesbi.recording.observation import read_observation
from swesbi.recording.speed import NoiseComponents
from swesbi.show.csv import write_csv
from swesbi.simulations import draw_simulations
from swesbi.study.stages.exact import ExactPosteriorStageSettings, write_posterior
from swesbi.study.stages.origin import Origin
from swesbi.study.stages.predictive import PredictiveSpeedsStageSettings, write_check
from swesbi.study.stages.verdict import VerdictStageSettings, judge
from swesbi.verdict.pooled import PopulationNull, pooled_reference, prior_predictive, read_null
from swesbi.verdict.verdict import network_test

LOGGER = logging.getLogger("swesbi")
STREAM = "population answer"


class PopulationCalibrationStageSettings(Settings):
    """What a part depends on, beside the network."""

    own: tuple[int, int]
    acquired: tuple[int, int]
    fresh: FreshSettings
    sizes: RecordingsSettings
    exact: ExactSettings
    refinement: RefinementSettings


def population_calibration(
    *, estimator: Path, part: Path, settings: PopulationCalibrationStageSettings, origin: Origin
) -> None:
    """Infer one recording of each of the numbered contexts, under the model's own noise and acquired.

    Raises:
        ArtefactError: The network is no such artefact.
    """
    flow, _ = load_spline(estimator)
    numbers = {OWN: range(*settings.own), ACQUIRED: range(*settings.acquired)}
    groups = {
        kind: fresh_dataset(
            infer_fresh(
                index,
                kind,
                flow,
                settings.fresh,
                settings.sizes,
                settings.exact,
                settings.refinement,
                origin.seed,
            )
        )
        for kind, index in numbers.items()
    }
    save(part, groups, origin.provenance(KIND, settings))


class PopulationScoresStageSettings(Settings):
    """What is asked of the answers."""

    prior: PriorSettings
    judgement: JudgementSettings
    strata: StrataSettings


def population_scores(
    *,
    parts: Sequence[Path],
    calibration: Path,
    table: Path,
    strata: Path,
    recovery: Path,
    recovery_acquisition: Path,
    settings: PopulationScoresStageSettings,
    origin: Origin,
) -> None:
    """Join the parts and judge them.

    Args:
        parts: Recordings of fresh contexts.
        calibration: Output, all of them together.
        table: Output, one row a check.
        strata: Output, coverage by sampler and stratum.
        recovery: Output, coverage of the exact posterior under the model's own noise.
        recovery_acquisition: Output, of recordings acquired sample by sample.
        settings: What is asked.
        origin: Whose work this is.

    Raises:
        ArtefactError: An input is no such part.
    """
    groups = join(parts)
    save(calibration, groups, origin.provenance(KIND, settings))
    found = {kind: fresh_of(group) for kind, group in groups.items()}
    judge = Judge(settings.prior, settings.judgement, settings.strata)
    write_csv(table, judge.checks(found))
    write_csv(strata, judge.by_stratum(found[OWN]))
    for path, kind in ((recovery, OWN), (recovery_acquisition, ACQUIRED)):
        rows = [asdict(row) for row in judge.recovery(found[kind].inferred.ranked)]
        write_csv(path, pd.DataFrame(rows), float_format=None)
    _report(found)


def _report(found: dict[str, FreshInferred]) -> None:
    for kind, part in found.items():
        diagnostics = part.inferred.diagnostics
        LOGGER.info(
            "%d %s recordings (%d refused): median efficiency %.0f %%, %d by MCMC",
            len(part.contexts), kind, part.refused, 100.0 * float(np.median(diagnostics.efficiency)),
            int(diagnostics.by_mcmc.sum()),
        )  # fmt: skip


class PopulationAnswersStageSettings(Settings):
    """What answers depend on, beside the files."""

    exact_posterior: ExactPosteriorStageSettings
    predictive_speeds: PredictiveSpeedsStageSettings
    verdict: VerdictStageSettings
    refinement: RefinementSettings
    predictive_recordings: int


def population_answers(
    *,
    observations: Sequence[Path],
    noise: Path,
    estimator: Path,
    null: Path,
    posteriors: Sequence[Path],
    supports: Sequence[Path],
    predictives: Sequence[Path],
    settings: PopulationAnswersStageSettings,
    origin: Origin,
) -> None:
    """Write posterior, verdict and predictive check of each subject of the batch, one after the other.

    Args:
        observations: Observed curves of the subjects.
        noise: Noise of their cohort.
        estimator: The network.
        null: Null recordings of the population.
        posteriors: Output, in the order of the subjects.
        supports: Output, likewise.
        predictives: Output, likewise.
        settings: Sizes and rules.
        origin: Seed and code.

    Raises:
        ArtefactError: An input is no such artefact.
        NoLikelihoodError: Every simulation of a subject fails.
    """
    flow, others, components = load_spline(estimator)[0], read_null(null), read_noise(noise).components
    progress = Progress(f"answers {estimator.parent.name}", len(observations), unit="subject")
    for paths in zip(observations, posteriors, supports, predictives, strict=True):
        _answer(*paths, components, flow, others, settings, origin)
        progress.step()


def _answer(
    observation: Path,
    posterior: Path,
    support: Path,
    predictive: Path,
    components: NoiseComponents,
    flow: TrainedSpline,
    others: PopulationNull,
    settings: PopulationAnswersStageSettings,
    origin: Origin,
) -> None:
    model = build_speed_model(observation, components, settings.exact_posterior.model)
    own = replace(origin, subject=model.recording.subject)
    efficiency = _infer(model, flow, posterior, settings, own)
    _judge(model, posterior, support, others, efficiency, settings, own)
    _check(model, observation, posterior, support, predictive, settings.predictive_speeds, own)


def _infer(
    model: SpeedModel,
    flow: TrainedSpline,
    posterior: Path,
    settings: PopulationAnswersStageSettings,
    origin: Origin,
) -> tuple[float, ...]:
    """Write the exact posterior; return the efficiency of the network's draws and of each refinement."""
    network, part = flow_proposal(flow, model.recording), settings.exact_posterior
    exact, efficiency = refined_posterior(
        model, network, part.exact, settings.refinement, origin.seed, STREAM, origin.subject
    )
    write_posterior(posterior, exact, network, part, origin)
    return efficiency


def _judge(
    model: SpeedModel,
    posterior: Path,
    support: Path,
    others: PopulationNull,
    efficiency: Sequence[float],
    settings: PopulationAnswersStageSettings,
    origin: Origin,
) -> None:
    rule, conditioning = settings.verdict.rule, settings.verdict.conditioning
    predictive = prior_predictive(model, conditioning, settings.predictive_recordings, origin.seed, STREAM)
    reference = pooled_reference(others.pooled, predictive, rule)
    tests = [network_test(efficiency, settings.refinement.min_efficiency)]
    judged = judge(posterior, model, others.contexts, reference, settings.verdict, origin, tests)
    write_json(support, judged.to_json())


def _check(
    model: SpeedModel,
    observation: Path,
    posterior: Path,
    support: Path,
    predictive: Path,
    settings: PredictiveSpeedsStageSettings,
    origin: Origin,
) -> None:
    sizes, part = settings.predictive, settings.model
    simulations = draw_simulations(
        range(sizes.draws), model.recording.context, part.prior.theta, part.forward_model, origin.seed
    )
    recorder = Recorder(model, read_observation(observation), sizes.features, settings.summary)
    write_check(posterior, support, predictive, recorder, simulations, settings, origin)
