"""Answering subjects with a trained network: posterior, verdict and predictive check of each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from swesbi.artefacts import write_json
from swesbi.base.settings import Settings
from swesbi.checks.draws import CheckedFeatures
from swesbi.checks.predictive_speeds import Recorder
from swesbi.context import Context
from swesbi.heart.prior_simulations import PriorSimulations, draw_simulations
from swesbi.measurement.likelihood import SpeedModel, build_speed_model
from swesbi.measurement.speeds import SpeedRecording
from swesbi.networks.flow.files import load_flow
from swesbi.networks.flow.flow import FlowProposal, flow_proposal
from swesbi.posterior.exact import exact_posterior
from swesbi.recording.clinical import NOT_MEASURED, ClinicalMeasures
from swesbi.recording.noise import read_noise
from swesbi.recording.observation import read_observation
from swesbi.study.stages.exact import ExactPosteriorStageSettings, write_posterior
from swesbi.study.stages.origin import Origin
from swesbi.study.stages.predictive import PredictiveSpeedsStageSettings, write_check
from swesbi.study.stages.verdict import VerdictStageSettings, judge
from swesbi.verdict.nulls import Reference
from swesbi.verdict.pooled import PooledNull, pooled_reference, prior_predictive, read_null
from swesbi.verdict.verdict import Verdict, VerdictTest
from swesbi.verdict.with_null import network_test

STREAM = "population answer"


class AnswerSettings(Settings):
    """Settings of the stages whose results an answer holds."""

    exact_posterior: ExactPosteriorStageSettings
    predictive_speeds: PredictiveSpeedsStageSettings
    verdict: VerdictStageSettings


@dataclass(frozen=True)
class Knowledge:
    """What answers a subject.

    Attributes:
        proposal: Makes the network's posterior of a recording.
        contexts: Contexts with which the subject's is compared.
        null: Loads the null recordings that the tests compare with.
    """

    proposal: Callable[[SpeedRecording], FlowProposal]
    contexts: Sequence[Context]
    null: Callable[[], PooledNull]


@dataclass(frozen=True)
class Answer:
    """The chain from one recording to its answer.

    ``stream`` names its random streams; ``clinical`` is what was measured of the subject beside the speeds.
    """

    model: SpeedModel
    knowledge: Knowledge
    settings: AnswerSettings
    origin: Origin
    stream: str
    clinical: ClinicalMeasures = NOT_MEASURED

    def infer(self, posterior: Path) -> tuple[float, ...]:
        """Write the exact posterior; return the efficiency after each round, the network's own first."""
        network, settings = self.knowledge.proposal(self.model.recording), self.settings.exact_posterior
        streams = (self.origin.seed, self.stream, self.origin.subject)
        exact, efficiency = exact_posterior(self.model, network, settings.exact, *streams)
        write_posterior(posterior, exact, network, settings, self.origin)
        return efficiency

    def reference(self, recordings: int) -> Reference:
        """Return the tests: the subject's own prior predictive of so many recordings, the null recordings."""
        rule, conditioning = self.settings.verdict.rule, self.settings.verdict.conditioning
        predictive = prior_predictive(self.model, conditioning, recordings, self.origin.seed, self.stream)
        return pooled_reference(self.knowledge.null(), predictive, rule)

    def judge(
        self,
        posterior: Path,
        verdict: Path,
        reference: Reference,
        efficiency: Sequence[float],
        further: Sequence[VerdictTest] = (),
    ) -> Verdict:
        """Write the verdict, by the tests of the reference, by ``further`` ones and by the efficiency."""
        tests = (
            *further,
            network_test(efficiency),
        )
        judged = judge(
            posterior,
            self.model,
            self.knowledge.contexts,
            reference,
            self.settings.verdict,
            self.origin,
            self.clinical,
            tests,
        )
        write_json(verdict, judged.to_json())
        return judged

    def check(
        self,
        observation: Path,
        posterior: Path,
        verdict: Path,
        predictive: Path,
        simulations: PriorSimulations,
    ) -> None:
        """Write the predictive checks, with these simulations of the prior."""
        settings = self.settings.predictive_speeds
        features = CheckedFeatures(settings.predictive.features, settings.summary)
        recorder = Recorder(self.model, read_observation(observation), features)
        write_check(posterior, verdict, predictive, recorder, simulations, settings, self.origin)


class PopulationAnswersStageSettings(AnswerSettings):
    """Settings of the stages, and the prior predictive recordings of each subject."""

    predictive_recordings: int


def population_answers(
    *,
    observation: Path,
    noise: Path,
    estimator: Path,
    null: Path,
    posterior: Path,
    verdict: Path,
    predictive: Path,
    settings: PopulationAnswersStageSettings,
    origin: Origin,
) -> None:
    """Write posterior, verdict and predictive check of a subject.

    Args:
        observation: Observed curve.
        noise: Noise of the cohort.
        estimator: The network.
        null: Null recordings of the population.
        posterior: Output.
        verdict: Output.
        predictive: Output.

    Raises:
        ArtefactError: An input is no such artefact.
        NoLikelihoodError: Every simulation fails.
    """
    flow, population, components = load_flow(estimator)[0], read_null(null), read_noise(noise).components
    knowledge = Knowledge(partial(flow_proposal, flow), population.contexts, lambda: population.pooled)
    speeds = build_speed_model(observation, components, settings.exact_posterior.model)
    answer = Answer(speeds, knowledge, settings, origin, STREAM, read_observation(observation).clinical)
    efficiency = answer.infer(posterior)
    answer.judge(posterior, verdict, answer.reference(settings.predictive_recordings), efficiency)
    sizes, model = settings.predictive_speeds.predictive, settings.predictive_speeds.model
    context, seed = speeds.recording.context, origin.seed
    draws = draw_simulations(range(sizes.draws), context, model.prior.theta, model.forward_model, seed)
    answer.check(observation, posterior, verdict, predictive, draws)
