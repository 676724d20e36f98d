"""One recording to its answer, in memory: the exact posterior and the verdict.

What a recording is (gated, free-running), whether pressures were taken, and what the inference begins with
(a network, the prior) choose terms of the likelihood and the proposal. The route is one.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from swesbi.answers.knowledge import Knowledge
from swesbi.answers.recording import ModelledRecording
from swesbi.answers.settings import AnswerSettings
from swesbi.base.arrays import FloatArray
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

LOGGER: Final = logging.getLogger("swesbi")


@dataclass(frozen=True)
class PriorDraws:
    """Draws of the prior that an answer is compared with.

    Attributes:
        phi: The parameters; shape (n, d).
        reported: All that an answer reports of each, by name; (n,) each.
    """

    phi: FloatArray
    reported: Mapping[str, FloatArray]


@dataclass(frozen=True)
class Answer:
    """What is known of a recorded heart.

    Attributes:
        recording: What was recorded, under the model.
        posterior: Its exact posterior.
        verdict: Whether the model contradicts the recording, and what the answer reports.
        reported: All that an answer reports of each draw of the posterior, by name; (n,) each.
        prior: Draws of the prior, with the same.
        with_pressures: The posterior with the pressures of a cuff; None where none were taken.
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
    """Infer and judge a recording.

    Args:
        recording: What was recorded, under the model.
        knowledge: What answers it.
        settings: Sizes, criteria and tests.
        seed: The study's seed.
        pressures: How the pressures of a cuff were measured; None: they are left out, if there are any.

    Raises:
        NoLikelihoodError: Every simulation of the first round fails.
        ValueError: The network takes no such recording.
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
    """Return the exact posterior of a recording with its pressures.

    It begins with the posterior of the speeds alone.

    Args:
        model: The recording's.
        of_speeds: Weighted draws of the posterior of the speeds.
        settings: Sizes and criteria.
        seed: The study's seed.
        name: Names the random streams.

    Raises:
        NoLikelihoodError: The likelihood is zero at every draw of the first round.
    """
    heart = HeartModel(model.speeds, model)
    known = placed_in(ScoreSpace(heart.settings.prior), heart.points(of_speeds.phi))
    fitted = fit_in_nearest([known], of_speeds.log_weight)
    exact, _ = exact_posterior(heart, None, settings, seed, *name, fitted=fitted)
    log_certificate(f"{model.speeds.recording.subject} with pressures", exact)
    return described(exact, heart.prior, None)
