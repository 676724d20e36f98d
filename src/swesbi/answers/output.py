"""What files, figures and the page of an answer take from a recording, of whatever kind it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from swesbi.answers.settings import AnswerSettings
from swesbi.base.arrays import FloatArray
from swesbi.checks.free_predictive import FreePredictiveCheck
from swesbi.checks.predictive import PredictiveCheck
from swesbi.measurement.derived import reported
from swesbi.measurement.likelihood import SpeedModel
from swesbi.prior import draw_prior
from swesbi.report.sheet import RecordingSummary, ShownCurve
from swesbi.seeds import generator

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


@dataclass(frozen=True)
class PriorDraws:
    """Draws of the prior that an answer is compared with.

    Attributes:
        phi: The parameters; shape (n, d).
        reported: All that an answer reports of each, by name; (n,) each.
    """

    phi: FloatArray
    reported: Mapping[str, FloatArray]


def prior_draws(model: SpeedModel, settings: AnswerSettings, seed: int, stream: str) -> PriorDraws:
    """Draw the prior that an answer is compared with.

    What the posterior began with may be a network's, so these are drawn anew.
    """
    count, subject = settings.predictive.draws, model.recording.context.subject
    phi = draw_prior(model.settings.prior, count, generator(seed, stream, subject, "prior curves"))
    return PriorDraws(phi, reported(model, phi, model.simulate(phi)))
