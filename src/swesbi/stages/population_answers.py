"""Stage: the answers for a batch of subjects by the network of a population."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from swesbi.artefacts import write_json
from swesbi.evaluation.new_recordings import Recorder
from swesbi.exact.proposal import flow_proposal
from swesbi.exact.refinement import refined_posterior
from swesbi.exact.settings import RefinementSettings
from swesbi.flow.files import load_flow
from swesbi.flow.net import TrainedFlow
from swesbi.misspecification.network import network_test
from swesbi.misspecification.pooled import pooled_reference, prior_predictive
from swesbi.noise.dataset import read_noise
from swesbi.population.null import PopulationNull
from swesbi.population.null_dataset import read_null
from swesbi.progress import Progress
from swesbi.recording.dataset import read_observation
from swesbi.recording.speed import NoiseComponents
from swesbi.settings import Settings
from swesbi.simulations.draw import draw_simulations
from swesbi.speed_model.model import SpeedModel
from swesbi.speed_model.subjects import build_speed_model
from swesbi.stages import exact_posterior, predictive_speeds, verdict
from swesbi.stages.origin import Origin

STREAM = "population answer"


class PopulationAnswersStageSettings(Settings):
    """What answers depend on, beside the files."""

    exact_posterior: exact_posterior.ExactPosteriorStageSettings
    predictive_speeds: predictive_speeds.PredictiveSpeedsStageSettings
    verdict: verdict.VerdictStageSettings
    refinement: RefinementSettings
    predictive_recordings: int


def run(
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
    flow, others, components = load_flow(estimator)[0], read_null(null), read_noise(noise).components
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
    flow: TrainedFlow,
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
    flow: TrainedFlow,
    posterior: Path,
    settings: PopulationAnswersStageSettings,
    origin: Origin,
) -> tuple[float, ...]:
    """Write the exact posterior; return the efficiency of the network's draws and of each refinement."""
    network, part = flow_proposal(flow, model.recording), settings.exact_posterior
    exact, efficiency = refined_posterior(
        model, network, part.exact, settings.refinement, origin.seed, STREAM, origin.subject
    )
    exact_posterior.write_posterior(posterior, exact, network, part, origin)
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
    judged = verdict.judge(posterior, model, others.contexts, reference, settings.verdict, origin, tests)
    write_json(support, judged.to_json())


def _check(
    model: SpeedModel,
    observation: Path,
    posterior: Path,
    support: Path,
    predictive: Path,
    settings: predictive_speeds.PredictiveSpeedsStageSettings,
    origin: Origin,
) -> None:
    sizes, part = settings.predictive, settings.model
    simulations = draw_simulations(
        range(sizes.draws), model.recording.context, part.prior.theta, part.forward_model, origin.seed
    )
    recorder = Recorder(model, read_observation(observation), sizes.features, settings.summary)
    predictive_speeds.write_check(posterior, support, predictive, recorder, simulations, settings, origin)
