"""The page on which the model is moved by hand."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from explorer.data import ExploredSubject, page_data
from explorer.page import render_page
from explorer.physics import physics
from swesbi import __version__
from swesbi.artefacts import Origin, atomic_path
from swesbi.base.settings import Settings
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.posterior.result import read_exact_posterior
from swesbi.posterior.settings import ExactSettings
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.recording.settings import RecordingSettings
from swesbi.study.stages.origin import by_key, pick
from swesbi.verdict.settings import RuleSettings
from swesbi.verdict.verdict import read_verdict


class ExplorerSettings(Settings):
    """The model that the page runs, criteria of its posteriors and recordings, and what it calls them."""

    model: SpeedModelSettings
    exact: ExactSettings
    recording: RecordingSettings
    rule: RuleSettings
    experiment: str
    cohort_title: str


def explorer(
    *,
    observations: Sequence[Path],
    posteriors: Sequence[Path],
    verdicts: Sequence[Path],
    noise: Path,
    page: Path,
    settings: ExplorerSettings,
    origin: Origin,
) -> None:
    """Write the page on which parameters are moved and beats follow: one file, without a network.

    Args:
        observations: Observed curves of the subjects, in the order of ``posteriors``.
        posteriors: Exact posteriors.
        verdicts: Verdicts of the same subjects.
        noise: Noise of the cohort.
        page: Output.

    Raises:
        ArtefactError: An input is no such artefact.
        UntranslatableError: The physics has something that JavaScript is not taught.
        ValueError: The page would be too large.
    """
    verdict_of = by_key(verdicts)
    subjects = [
        ExploredSubject(
            Observation.read(observation),
            read_exact_posterior(posterior),
            read_verdict(pick(verdict_of, key, "verdict")),
        )
        for observation, (key, posterior) in zip(observations, by_key(posteriors).items(), strict=True)
    ]
    data = page_data(subjects, CohortNoise.read(noise), settings.model, settings.recording, origin.seed)
    words = {
        "title": settings.cohort_title,
        "cohort_title": settings.cohort_title,
        "experiment": settings.experiment,
        "origin": f"Made by swesbi {__version__}, seed {origin.seed}, code {origin.code_hash}.",
    }
    with atomic_path(page) as temporary:
        temporary.write_text(
            render_page(words, data, physics(settings.model, settings.exact, settings.rule)), encoding="utf-8"
        )
