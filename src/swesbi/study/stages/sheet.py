"""The page of one answered subject, of whatever kind its recording is."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray, IntArray
from swesbi.base.settings import Settings
from swesbi.checks.free_predictive import read_free_predictive
from swesbi.checks.identifiability.more_repeats import MoreRepeats, more_repeats
from swesbi.checks.predictive import read_predictive
from swesbi.context import Context
from swesbi.measurement.derived import told
from swesbi.measurement.instants import FreeModel
from swesbi.measurement.likelihood import SpeedModel
from swesbi.posterior.result import ExactResult, read_exact_result
from swesbi.prior import spread_points
from swesbi.recording.clinical import ClinicalMeasures
from swesbi.recording.free_observation import read_free_observation
from swesbi.recording.observation import read_observation
from swesbi.report.figures.sheet import draw_sheet
from swesbi.report.figures.style import save_figure
from swesbi.report.sheet import (
    Informed,
    Population,
    Recorded,
    Sheet,
    ShownCurve,
    curve_free,
    curve_gated,
    recorded_free,
    recorded_gated,
)
from swesbi.verdict.verdict import read_verdict

OF_STUDY: Final = "of the prior of the study, which all of its subjects share"
OF_POPULATION: Final = "of the prior of the population that the network was trained on"
PRIOR_DRAWS: Final = 2048
"""Of the prior, spread evenly, whose quantities are simulated for the percentiles."""
OF_PRIOR: Final = "of the prior from which the answer began"


class SheetSettings(Settings):
    """What the page depends on beside the answer."""

    cohort_title: str
    difference_step: float
    draws: int


def save_sheet_of_samples(
    *,
    model: SpeedModel,
    observation: Path,
    posterior: Path,
    verdict: Path,
    predictive: Path,
    with_pressures: Sequence[Path],
    sheet: Path,
    population: str,
    hearts: Sequence[Context],
    clinical: ClinicalMeasures,
    settings: SheetSettings,
) -> None:
    """Write the page of a gated recording.

    Args:
        model: Of the recording.
        observation: The observed curve.
        posterior: Exact posterior.
        verdict: Verdict.
        predictive: Predictive check.
        with_pressures: Exact posterior with pressures; one file or none.
        sheet: Output, ``sheet.pdf``.
        population: Whose prior percentiles are of, in words.
        hearts: Contexts that the network knows.
        clinical: The pressures, where there are any.
        settings: Of the page.

    Raises:
        ArtefactError: A file is no such artefact, or the page cannot be written.
    """
    informed = [Informed(clinical, read_exact_result(path)) for path in with_pressures]
    curve = curve_gated(read_predictive(predictive)[0])
    recorded = recorded_gated(read_observation(observation))
    # the model has an error of its own at each gated phase
    cell = np.arange(len(model.recording.phase))
    among = population, hearts
    _save(sheet, model, cell, (posterior, verdict), recorded, curve, among, informed, settings)


def save_sheet_of_pushes(
    *,
    model: FreeModel,
    observation: Path,
    posterior: Path,
    verdict: Path,
    predictive: Path,
    sheet: Path,
    population: str,
    settings: SheetSettings,
) -> None:
    """Write the page of a free-running recording; arguments and errors as of gated ones."""
    recorded, curve = (
        recorded_free(read_free_observation(observation)),
        curve_free(read_free_predictive(predictive)),
    )
    among = population, ()
    _save(sheet, model.model, model.cell, (posterior, verdict), recorded, curve, among, (), settings)


def _save(
    sheet: Path,
    model: SpeedModel,
    cell: IntArray,
    answer: tuple[Path, Path],
    recorded: Recorded,
    curve: ShownCurve,
    among: tuple[str, Sequence[Context]],
    informed: Sequence[Informed],
    settings: SheetSettings,
) -> None:
    posterior, verdict = answer
    result = read_exact_result(posterior)
    name, hearts = among
    page = Sheet(
        context=model.recording.context,
        verdict=read_verdict(verdict),
        result=result,
        values=_told(model, result.phi),
        recorded=recorded,
        curve=curve,
        population=Population(name, _told(model, spread_points(model.settings.prior)[:PRIOR_DRAWS]), hearts),
        more=_more(model, cell, result, settings),
        informed=informed,
        cohort_title=settings.cohort_title,
    )
    save_figure(draw_sheet(page), sheet)


def _told(model: SpeedModel, phi: FloatArray) -> FloatArray:
    """Return all that the answer tells of those of n draws that have a beat; shape (m, q)."""
    values = np.column_stack(list(told(model, phi, model.simulate(phi)).values()))
    return np.asarray(values[np.isfinite(values).all(axis=1)])


def _more(
    model: SpeedModel, cell: IntArray, result: ExactResult, settings: SheetSettings
) -> MoreRepeats | None:
    """Return what more repeats would buy, by draws spread over those of the posterior.

    None of a posterior that has not converged, whose widths mean nothing.
    """
    if not result.converged:
        return None
    rows = np.linspace(0, len(result.phi) - 1, min(settings.draws, len(result.phi))).astype(np.int64)
    return more_repeats(model, cell, result.phi[rows], settings.difference_step)
