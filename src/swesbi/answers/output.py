"""The predictive check of an answer, and what files, figures and the page take from it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from swesbi.answers.answer import Answer
from swesbi.answers.settings import AnswerSettings
from swesbi.checks.draws import CheckedFeatures
from swesbi.checks.free_predictive import FreePredictiveCheck, check_pushes
from swesbi.checks.predictive import PredictiveCheck
from swesbi.checks.predictive_speeds import Recorder, new_recordings, predictive_check, stream_of
from swesbi.recording.observation import SOURCES
from swesbi.report.sheet import (
    RecordingSummary,
    ShownCurve,
    curve_free,
    curve_gated,
    recorded_free,
    recorded_gated,
)
from swesbi.seeds import generator
from swesbi.verdict.verdict import Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class PredictiveOutput:
    """A predictive check as it is kept and shown.

    Attributes:
        check: What ``predictive.h5`` holds.
        draw: Draws its figure; the title of the cohort is its argument.
        recorded: The recording's quality, for the page.
        curve: Recording and predictive check, for the page.
    """

    check: PredictiveCheck | FreePredictiveCheck
    draw: Callable[[str], Figure]
    recorded: RecordingSummary
    curve: ShownCurve


def predictive_output(answer: Answer, settings: AnswerSettings, seed: int) -> PredictiveOutput:
    """Compare the recording of an answer with what prior and posterior predict of new ones.

    Raises:
        ValueError: No draw of the posterior can be simulated.
    """
    model, observed, verdict = answer.recording.model, answer.recording.observation, answer.verdict
    phi, prior, predictive = answer.posterior.phi, answer.prior.phi, settings.predictive
    if not observed.is_gated:
        points = model.settings.measurement.grid_points
        rng = generator(seed, answer.recording.stream, observed.subject, "new pushes")
        pushes = check_pushes(model, phi[: predictive.draws], prior, predictive.interval, points, rng)
        draw = partial(_draw_pushes, observed.subject, pushes, verdict, SOURCES[observed.errors_from])
        return PredictiveOutput(pushes, draw, recorded_free(observed), curve_free(pushes))
    features = CheckedFeatures(predictive.features, settings.summary)
    recorder, readable = Recorder(model, observed, features), verdict.may_be_read
    before = new_recordings(prior, recorder, stream_of(recorder, seed, "prior"))
    check = predictive_check(recorder, phi, before, predictive, seed, may_be_read=readable)
    draw = partial(_draw_gated, observed.subject, check, verdict)
    return PredictiveOutput(check, draw, recorded_gated(observed), curve_gated(check))


def _draw_pushes(
    subject: str, check: FreePredictiveCheck, verdict: Verdict, errors: str, title: str
) -> Figure:
    # half a second to import, of which a job that writes the check needs nothing
    from swesbi.report.figures.free_predictive import draw_free_check

    return draw_free_check(subject, check, verdict, errors, title)


def _draw_gated(subject: str, check: PredictiveCheck, verdict: Verdict, title: str) -> Figure:
    from swesbi.report.figures.predictive import PredictivePanel, draw_subject_check

    return draw_subject_check(PredictivePanel(subject, check, None, verdict), title)
