"""The page on which the model is moved by hand."""

from __future__ import annotations

from explorer.data import ExploredSubject, page_data
from explorer.page import render_page
from explorer.physics import physics
from swesbi import __version__
from swesbi.artefacts.typed import BySubject, Text
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.settings import ExactSettings
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.recording.settings import RecordingSettings
from swesbi.verdict.settings import RuleSettings
from swesbi.verdict.verdict import Verdict


def explorer(
    observations: tuple[Observation, ...],
    posteriors: BySubject[ExactPosterior],
    verdicts: BySubject[Verdict],
    noise: CohortNoise,
    *,
    model: SpeedModelSettings,
    exact: ExactSettings,
    recording: RecordingSettings,
    rule: RuleSettings,
    experiment: str,
    cohort_title: str,
    seed: int,
    code: str,
) -> Text:
    """Return the page on which parameters are moved and beats follow: one file, without a network.

    Raises:
        UntranslatableError: The physics has something that JavaScript is not taught.
        ValueError: The page would be too large.
    """
    subjects = [
        ExploredSubject(observed, posteriors[observed.subject], verdicts[observed.subject])
        for observed in observations
    ]
    words = {
        "title": cohort_title,
        "cohort_title": cohort_title,
        "experiment": experiment,
        "origin": f"Made by swesbi {__version__}, seed {seed}, code {code}.",
    }
    data = page_data(subjects, noise, model, recording, seed)
    return render_page(words, data, physics(model, exact, rule))
