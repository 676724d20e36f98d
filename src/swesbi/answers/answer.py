"""One recording to its answer, in memory: exact posterior, verdict and predictive check.

What a recording is (gated, free-running), whether pressures were taken, and what the inference begins with
(a network, the prior) choose terms of the likelihood and the proposal. The route is one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from swesbi.answers.knowledge import Knowledge
from swesbi.answers.recording import ModelledRecording
from swesbi.answers.settings import AnswerSettings
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
from swesbi.measurement.clinical import ClinicalModel, with_pressures
from swesbi.measurement.derived import reported
from swesbi.posterior.exact import described, exact_posterior, log_certificate
from swesbi.posterior.fitted import fit_in_nearest, placed_in
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.importance import WeightedDraws
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.settings import ExactSettings
from swesbi.posterior.space import ScoreSpace
from swesbi.prior import draw_prior
from swesbi.recording.cohort.clinical import ClinicalErrors
from swesbi.seeds import generator
from swesbi.verdict.contraction import contractions
from swesbi.verdict.recording import judge, network_test
from swesbi.verdict.verdict import Verdict

AnyCheck = PredictiveCheck | FreePredictiveCheck
"""Of gated phases, or of pushes."""


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
    subject, network = observed.subject, knowledge.proposal(model.recording)
    drawn, efficiency = exact_posterior(HeartModel(model), network, settings.exact, seed, stream, subject)
    log_certificate(subject, drawn)
    exact = described(drawn, model.settings.prior, network)
    beats = model.simulate(exact.phi)
    after = reported(model, exact.phi, beats)
    # the posterior may have begun with draws of a network, so those of the prior are drawn anew
    rng = generator(seed, stream, subject, "prior curves")
    phi = draw_prior(model.settings.prior, settings.predictive.draws, rng)
    before = PriorDraws(phi, reported(model, phi, model.simulate(phi)))
    tests = (*recording.tests, *(() if knowledge.flow is None else (network_test(efficiency),)))
    hearts, clinical = knowledge.hearts, observed.clinical
    judged = judge(exact, model, beats, knowledge.nulls, hearts, settings, seed, clinical, tests)
    verdict = contractions(after, before.reported, settings.uninformative).beside(judged)
    LOGGER.info("subject %s: %s", subject, verdict.sentence)
    found = None
    if pressures is not None and recording.has_pressures:
        both = with_pressures(model, clinical, pressures)
        found = informed(both, exact.weighted, settings.exact, seed, stream, "pressures", subject)
    return Answer(recording, exact, verdict, after, before, found)


def informed(
    model: ClinicalModel,
    of_speeds: WeightedDraws,
    settings: ExactSettings,
    seed: int,
    *name: str,
) -> ExactPosterior:
    """Return the exact posterior of a recording with its pressures; ``name`` names the random streams.

    It begins with the posterior of the speeds alone.
    """
    heart = HeartModel(model.speeds, model)
    known = placed_in(ScoreSpace(heart.settings.prior), heart.points(of_speeds.phi))
    fitted = fit_in_nearest([known], of_speeds.log_weight)
    exact, _ = exact_posterior(heart, None, settings, seed, *name, fitted=fitted)
    log_certificate(f"{model.speeds.recording.subject} with pressures", exact)
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
