"""Stage: the figure of one subject's predictive check."""

from __future__ import annotations

from pathlib import Path

from swesbi.evaluation.cmaes_dataset import read_cmaes
from swesbi.evaluation.predictive_dataset import read_predictive
from swesbi.figures import ppc_subject
from swesbi.figures.panels import PredictivePanel
from swesbi.figures.style import save_figure
from swesbi.inference.support import read_support
from swesbi.settings import Settings
from swesbi.stages.origin import Origin


class PpcFigureSettings(Settings):
    """What the figure calls the subjects."""

    cohort_title: str


def run(
    *,
    predictive: Path,
    support: Path,
    cmaes: Path,
    figure: Path,
    settings: PpcFigureSettings,
    origin: Origin,
) -> None:
    """Draw the predictive check; ``figure`` is a .png or .pdf."""
    check, provenance = read_predictive(predictive)
    fit, _ = read_cmaes(cmaes)
    panel = PredictivePanel(provenance.subject, check, fit, read_support(support))
    save_figure(ppc_subject.draw(panel, settings.cohort_title), figure)
