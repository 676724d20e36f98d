"""The figure of the noise as the documentation shows it: beside what the recordings were made with."""

from __future__ import annotations

from pathlib import Path

from swesbi.figures.noise import draw_noise
from swesbi.figures.style import save_figure
from swesbi.noise.dataset import read_noise
from swesbi.recording.speed import NoiseComponents
from swesbi.virtual_cohort.settings import ACQUISITION
from swesbi.virtual_cohort.volunteers import VOLUNTEERS


def write_noise_figure(noise: Path, docs: Path, cohort_title: str) -> None:
    """Draw the cohort's noise into ``docs/figures``; with the truth where all are virtual volunteers.

    Raises:
        ArtefactError: There is no such artefact.
    """
    found = read_noise(noise)
    virtual = {volunteer.context.subject for volunteer in VOLUNTEERS} >= set(found.by_subject)
    made_with = NoiseComponents(ACQUISITION.repeat_sd_fraction, ACQUISITION.sample_sd_fraction)
    figure = draw_noise(found, cohort_title, made_with if virtual else None)
    save_figure(figure, docs / "figures" / "noise.png")
