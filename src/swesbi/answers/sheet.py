"""The page of one answered subject, of whatever kind its recording is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from swesbi.answers.answer import Answer
from swesbi.answers.knowledge import Knowledge
from swesbi.answers.predictive import AnyCheck
from swesbi.answers.recording import ModelledRecording
from swesbi.answers.settings import OneAnswerSettings
from swesbi.base.arrays import FloatArray
from swesbi.checks.free_predictive import FreePredictiveCheck
from swesbi.checks.identifiability.more_repeats import MoreRepeats, more_repeats
from swesbi.posterior.result import ExactPosterior
from swesbi.report.sheet import (
    Population,
    PressuresPosterior,
    Sheet,
    curve_free,
    curve_gated,
    recorded_free,
    recorded_gated,
)


def sheet_of(answer: Answer, knowledge: Knowledge, check: AnyCheck, settings: OneAnswerSettings) -> Sheet:
    """Return what the page of an answer, with its predictive check, shows."""
    recording, exact = answer.recording, answer.posterior
    observed, both = recording.observation, answer.with_pressures
    if isinstance(check, FreePredictiveCheck):
        recorded, curve = recorded_free(observed), curve_free(check)
    else:
        recorded, curve = recorded_gated(observed), curve_gated(check)
    return Sheet(
        context=observed.context,
        verdict=answer.verdict,
        result=exact,
        values=_rows(answer.reported),
        recorded=replace(recorded, noise=recording.noise),
        curve=curve,
        population=Population(knowledge.population, _rows(answer.prior.reported), knowledge.hearts),
        more=_more(recording, exact, settings),
        informed=[] if both is None else [PressuresPosterior(observed.clinical, both)],
        cohort_title=settings.cohort_title,
    )


def _rows(reported: Mapping[str, FloatArray]) -> FloatArray:
    """Return all that the answer tells of those of n draws that have a beat; shape (m, q)."""
    values = np.column_stack(list(reported.values()))
    return np.asarray(values[np.isfinite(values).all(axis=1)])


def _more(
    recording: ModelledRecording, exact: ExactPosterior, settings: OneAnswerSettings
) -> MoreRepeats | None:
    """Return what more repeats would buy, by draws spread over those of the posterior.

    None of a posterior that has not converged, whose widths mean nothing.
    """
    if not exact.converged:
        return None
    number = min(settings.repeats_draws, len(exact.phi))
    rows = np.linspace(0, len(exact.phi) - 1, number).astype(np.int64)
    return more_repeats(recording.model, exact.phi[rows], settings.difference_step)
