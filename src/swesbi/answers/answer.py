"""One recording to its answer, in memory: what answers it, exact posterior, verdict and predictive check.

What a recording is (gated, free-running), whether pressures were taken, and what the inference begins with
(a network, the prior) choose terms of the likelihood and the proposal. The route is one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, NamedTuple

from pydantic import Field

from swesbi.answers.recording import ModelledRecording
from swesbi.artefacts.files import stated_checksum
from swesbi.base.arrays import FloatArray
from swesbi.base.progress import LOGGER
from swesbi.checks.predictive import CheckedFeatures, FreePredictiveCheck, PredictiveCheck
from swesbi.checks.predictive_speeds import (
    Recorder,
    check_pushes,
    new_recordings,
    predictive_check,
    stream_of,
)
from swesbi.checks.settings import PredictiveSettings
from swesbi.context import Context
from swesbi.measurement.clinical import with_pressures
from swesbi.measurement.derived import reported
from swesbi.measurement.likelihood import (
    SpeedModel,
    SpeedModelSettings,
    simulate_draws,
    speed_model,
)
from swesbi.measurement.settings import MeasurementSettings, SummarySettings
from swesbi.measurement.speeds import SpeedRecording
from swesbi.networks.flow.trained import FlowProposal, TrainedFlow, flow_proposal
from swesbi.posterior.adaptive import AdaptedDraws
from swesbi.posterior.exact import described, exact_posterior, log_sampling
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.settings import ExactSettings
from swesbi.posterior.space import LogitSpace, Space
from swesbi.prior import JointPriorSettings, draw_prior
from swesbi.recording.cohort.clinical import ClinicalErrors, ClinicalRow
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.recording.settings import ContextRow, RecordingSettings
from swesbi.recording.tables.layout import TableLayout
from swesbi.seeds import generator
from swesbi.verdict.context import nearest_known
from swesbi.verdict.contraction import contractions
from swesbi.verdict.null_recordings import NullRecordings
from swesbi.verdict.recording import VerdictSettings, judge, network_test
from swesbi.verdict.settings import EjectionTimeSettings, RuleSettings, UninformativeSettings
from swesbi.verdict.verdict import Verdict

STREAM: Final = "population answer"
"""Begins the names of the random streams of a population's answers for the cohort."""
AnyCheck = PredictiveCheck | FreePredictiveCheck
"""Of gated phases, or of pushes."""


class AnswerSettings(VerdictSettings):
    """What posterior, verdict and predictive check of a recording depend on."""

    exact: ExactSettings
    summary: SummarySettings
    predictive: PredictiveSettings
    uninformative: UninformativeSettings


class OneAnswerSettings(AnswerSettings):
    """The same of a subject outside the study: its row, its recording, tests and figures of its own."""

    context: ContextRow
    clinical_row: ClinicalRow
    recording: RecordingSettings
    measurement: MeasurementSettings
    layout: TableLayout
    noise_level: float = Field(gt=0.0, lt=0.5, description="of the test that the noise is that of the others")
    clinical: ClinicalErrors
    cohort_title: str
    joint_prior: JointPriorSettings
    difference_step: float
    repeats_draws: int


@dataclass(frozen=True)
class Knowledge:
    """What answers recordings.

    Without a network the inference begins with the prior. ``trained`` are the contexts that it was trained
    on, if these are but some: it is shown the nearest. ``made_from`` are checksums of the files of all this.
    """

    nulls: NullRecordings
    flow: TrainedFlow | None = None
    trained: Sequence[Context] = ()
    made_from: tuple[str, ...] = ()

    @property
    def hearts(self) -> Sequence[Context]:
        """Contexts with which the subject's is compared."""
        return self.trained or self.nulls.contexts

    @property
    def population(self) -> str:
        """Whose prior the percentiles of an answer are of, in words."""
        if self.flow is None:
            return "of the prior from which the answer began"
        if self.trained:
            return "of the prior of the study, which all of its subjects share"
        return "of the prior of the population that the network was trained on"

    def proposal(self, recording: SpeedRecording) -> FlowProposal | None:
        """Return the network's posterior of a recording; None where there is no network.

        A network that knows the phases of its own subjects alone refuses pushes by a ValueError.
        """
        if self.flow is None:
            return None
        known = nearest_known(recording.context, self.trained) if self.trained else recording.context
        return flow_proposal(self.flow, replace(recording, context=known))

    def space(self, model: SpeedModel) -> Space:
        """Return the space in which the posterior of a gated recording's heart is nearest to normal."""
        return self.proposal(model.recording) or LogitSpace(model.settings.prior.simulated)


def knowledge_from(null: Path, network: Path | None = None, cohort: Sequence[Path] = ()) -> Knowledge:
    """Read what answers recordings: the network of a population or of a study's cohort, or the prior.

    ``cohort`` are the observed curves whose contexts the network was trained on; none over a population.
    """
    nulls, trained = NullRecordings.read(null), [Observation.read(path).context for path in cohort]
    flow = None if network is None else TrainedFlow.read(network)
    read = tuple(map(stated_checksum, filter(None, (network, *cohort, null))))
    return Knowledge(nulls, flow, trained, read)


@dataclass(frozen=True)
class PriorDraws:
    """Draws of the prior: phi, of shape (n, d), and by name all that an answer reports of each, (n,)."""

    phi: FloatArray
    reported: Mapping[str, FloatArray]


@dataclass(frozen=True)
class Answer:
    """What is known of a recorded heart.

    ``reported`` is by name all that an answer reports of each draw of the posterior, (n,). The posterior with
    the pressures of a cuff is None where none were taken.
    """

    recording: ModelledRecording
    posterior: ExactPosterior
    verdict: Verdict
    reported: Mapping[str, FloatArray]
    prior: PriorDraws
    with_pressures: ExactPosterior | None = None


def answered(
    recording: ModelledRecording,
    knowledge: Knowledge,
    settings: AnswerSettings,
    seed: int,
    pressures: ClinicalErrors | None = None,
) -> Answer:
    """Infer and judge a recording; pressures of a cuff are left out where nothing is said of their errors.

    NoLikelihoodError is raised where every simulation of the first round fails.
    """
    model, stream, observed = recording.model, recording.stream, recording.observation
    subject, network, clinical = observed.subject, knowledge.proposal(model.recording), observed.clinical
    heart = HeartModel(model)
    if pressures is not None and recording.has_pressures:
        heart = HeartModel(model, with_pressures(model, clinical, pressures), informed=False)
    found, drawn = exact_posterior(heart, network, settings.exact, seed, stream, subject)
    log_sampling(subject, found)
    exact = described(found, model.settings.prior, network)
    beats = simulate_draws(model, exact.phi)
    after = reported(model, exact.phi, beats)
    # the posterior may have begun with draws of a network, so those of the prior are drawn anew
    rng = generator(seed, stream, subject, "prior curves")
    phi = draw_prior(model.settings.prior, settings.predictive.draws, rng)
    before = PriorDraws(phi, reported(model, phi, model.simulate(phi)))
    tests = (*recording.tests, *(() if knowledge.flow is None else (network_test(drawn.efficiency),)))
    hearts = knowledge.hearts
    judged = judge(exact, model, beats, knowledge.nulls, hearts, settings, seed, clinical, tests)
    verdict = contractions(after, before.reported, settings.uninformative).beside(judged)
    LOGGER.info("subject %s: %s", subject, verdict.sentence)
    informed = None
    if heart.pressures is not None:
        informed = with_pressures_too(heart, drawn, settings.exact, seed, stream, subject)
    return Answer(recording, exact, verdict, after, before, informed)


def with_pressures_too(
    heart: HeartModel, of_speeds: AdaptedDraws, settings: ExactSettings, seed: int, stream: str, subject: str
) -> ExactPosterior:
    """Return the exact posterior of a recording with its pressures, from the draws of that without them.

    The beats of those draws have told the pressures, so that none is simulated again.
    """
    both, known = replace(heart, informed=True), of_speeds.informed(settings)
    exact, _ = exact_posterior(both, None, settings, seed, stream, "pressures", subject, former=known)
    log_sampling(f"{subject} with pressures", exact)
    return described(exact, heart.prior, None)


def check_answer(answer: Answer, settings: AnswerSettings, seed: int) -> AnyCheck:
    """Compare the recording of an answer with what prior and posterior predict of new ones."""
    model, observed = answer.recording.model, answer.recording.observation
    phi, prior, predictive = answer.posterior.phi, answer.prior.phi, settings.predictive
    if not observed.is_gated:
        points = model.settings.measurement.grid_points
        rng = generator(seed, answer.recording.stream, observed.subject, "new pushes")
        return check_pushes(model, phi[: predictive.draws], prior, predictive.interval, points, rng)
    recorder = Recorder(model, observed, CheckedFeatures(predictive.features, settings.summary))
    before = new_recordings(prior, recorder, stream_of(recorder, seed, "prior"))
    return predictive_check(recorder, phi, before, predictive, seed, may_be_read=answer.verdict.may_be_read)


class AnswerOfPopulation(NamedTuple):
    """What the network of a population says of a subject."""

    posterior: ExactPosterior
    verdict: Verdict
    predictive: AnyCheck
    with_pressures: ExactPosterior | None


def answer_of_population(
    observation: Observation,
    noise: CohortNoise,
    estimator: TrainedFlow,
    null: NullRecordings,
    *,
    model: SpeedModelSettings,
    exact: ExactSettings,
    summary: SummarySettings,
    predictive: PredictiveSettings,
    rule: RuleSettings,
    ejection_time: EjectionTimeSettings,
    lvet_sd_ms: float,
    uninformative: UninformativeSettings,
    cuff: ClinicalErrors | None,
    seed: int,
) -> AnswerOfPopulation:
    """Answer a subject of the cohort; ``cuff`` has the errors of pressures, of a subject who has them."""
    settings = AnswerSettings(
        model=model,
        exact=exact,
        summary=summary,
        predictive=predictive,
        rule=rule,
        ejection_time=ejection_time,
        lvet_sd_ms=lvet_sd_ms,
        uninformative=uninformative,
    )
    recording = ModelledRecording(observation, speed_model(observation, noise, model), stream=STREAM)
    answer = answered(recording, Knowledge(null, estimator), settings, seed, cuff)
    check = check_answer(answer, settings, seed)
    return AnswerOfPopulation(answer.posterior, answer.verdict, check, answer.with_pressures)
