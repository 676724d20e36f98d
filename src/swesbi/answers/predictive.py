"""The predictive check of an answer."""

from __future__ import annotations

from swesbi.answers.answer import Answer
from swesbi.answers.settings import AnswerSettings
from swesbi.checks.free_predictive import FreePredictiveCheck, check_pushes
from swesbi.checks.predictive import CheckedFeatures, PredictiveCheck
from swesbi.checks.predictive_speeds import Recorder, new_recordings, predictive_check, stream_of
from swesbi.seeds import generator

AnyCheck = PredictiveCheck | FreePredictiveCheck
"""Of gated phases, or of pushes."""


def check_answer(answer: Answer, settings: AnswerSettings, seed: int) -> AnyCheck:
    """Compare the recording of an answer with what prior and posterior predict of new ones.

    Raises:
        ValueError: No draw of the posterior can be simulated.
    """
    model, observed = answer.recording.model, answer.recording.observation
    phi, prior, predictive = answer.posterior.phi, answer.prior.phi, settings.predictive
    if not observed.is_gated:
        points = model.settings.measurement.grid_points
        rng = generator(seed, answer.recording.stream, observed.subject, "new pushes")
        return check_pushes(model, phi[: predictive.draws], prior, predictive.interval, points, rng)
    recorder = Recorder(model, observed, CheckedFeatures(predictive.features, settings.summary))
    before = new_recordings(prior, recorder, stream_of(recorder, seed, "prior"))
    readable = answer.verdict.may_be_read
    return predictive_check(recorder, phi, before, predictive, seed, may_be_read=readable)
