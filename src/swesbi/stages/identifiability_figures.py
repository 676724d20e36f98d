"""Stage: the figures of the study of identifiability."""

from __future__ import annotations

from pathlib import Path

from swesbi.artefacts import load
from swesbi.artefacts.kinds.identifiability import SCHEMAS
from swesbi.identifiability.dataset import KIND
from swesbi.settings import Settings
from swesbi.show.figures.identifiability import draw_design, draw_identifiability
from swesbi.show.figures.style import save_figure
from swesbi.stages.origin import Origin


class IdentifiabilityFiguresSettings(Settings):
    """What the figures call the subjects."""

    cohort_title: str


def run(
    *,
    identifiability: Path,
    identifiability_pdf: Path,
    identifiability_png: Path,
    design_pdf: Path,
    design_png: Path,
    settings: IdentifiabilityFiguresSettings,
    origin: Origin,
) -> None:
    """Draw what the recordings tell, and what others would.

    Raises:
        ArtefactError: The file is not such an artefact.
    """
    groups = {name: load(identifiability, KIND, name)[0] for name in SCHEMAS[KIND]}
    save_figure(draw_identifiability(groups, settings.cohort_title), identifiability_pdf, identifiability_png)
    save_figure(draw_design(groups, settings.cohort_title), design_pdf, design_png)
