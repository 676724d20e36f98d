"""What the page is given beside the physics: parameters with their priors, subjects, recordings and draws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.context import CONTEXT
from swesbi.draws import median_and_interval
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.measurement.speeds import measured_speeds
from swesbi.parameters import NUISANCES, PHI, PHI_NAMES
from swesbi.posterior.result import ExactPosterior
from swesbi.prior import sample
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.recording.settings import RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.seeds import generator
from swesbi.verdict.verdict import Verdict

DRAWS: Final = 100
"""Of the prior, and of each posterior: curves that a browser computes in a fraction of a second."""
DIGITS: Final = 6
"""Of a draw: its curve so differs by less than the width of a line."""


@dataclass(frozen=True)
class ExploredSubject:
    """One subject of the study: its recording, its exact posterior, and the verdict on it."""

    observation: Observation
    posterior: ExactPosterior
    verdict: Verdict


def page_data(
    subjects: Sequence[ExploredSubject],
    noise: CohortNoise,
    model: SpeedModelSettings,
    quality: RecordingSettings,
    seed: int,
) -> dict[str, Any]:
    """Return the data of the page, plain; subjects are listed in their order, and there is at least one.

    Errors of the means follow from the cohort's noise. By ``quality`` a recording dropped on the page is
    checked; the seed is that of prior draws.
    """
    prior = sample(DRAWS, model.prior, generator(seed, "explorer", "prior"))
    return {
        "parameters": parameters(model),
        "context": asdict(subjects[0].observation.context),
        "context_sliders": context_sliders(),
        "prior_draws": rounded(prior),
        "noise": asdict(noise.usual),
        "quality": quality.to_plain(),
        "subjects": [subject_data(subject, noise.of(subject.observation.subject)) for subject in subjects],
    }


def parameters(model: SpeedModelSettings) -> list[dict[str, Any]]:
    """Return name, words, unit and prior of each parameter of phi, in its order."""
    known = {parameter.name: parameter for parameter in (*PHI, *NUISANCES)}
    return [
        {
            "name": name,
            "words": known[name].meaning,
            "symbol": known[name].html,
            "unit": known[name].html_unit,
            "reported": name in PHI_NAMES,
            **prior.to_plain(),
        }
        for name, prior in zip(model.prior.names, model.prior.parameters, strict=True)
    ]


def context_sliders() -> list[dict[str, Any]]:
    """Return the context variables that the forward model takes, with the range in which it is declared."""
    return [
        {
            "name": variable.name,
            "words": variable.words,
            "symbol": "",
            "unit": variable.shown_unit,
            "low": variable.declared[0],
            "high": variable.declared[1],
        }
        for variable in CONTEXT
        if variable.declared
    ]


def subject_data(subject: ExploredSubject, noise: NoiseComponents) -> dict[str, Any]:
    """Return one subject: context, verdict, recording, and draws of its posterior with their median."""
    observed, phi = subject.observation, subject.posterior.phi
    measured, speeds = observed.measured, measured_speeds(observed, noise)
    return {
        "name": observed.subject,
        "context": asdict(observed.context),
        "verdict": subject.verdict.sentence,
        "recording": {
            "phase": rounded(speeds.phase),
            "speed_m_s": speeds.speed_m_s.tolist(),
            "relative_se": speeds.relative_se.tolist(),
            "shared": speeds.shared.tolist(),
            "stiffness_kpa": rounded(observed.stiffness_kpa[measured]),
            "stiffness_se_kpa": rounded(2.0 * observed.stiffness_kpa[measured] * speeds.errors.total),
        },
        "median": rounded(np.median(phi, axis=0)),
        "quantiles": rounded(np.stack(median_and_interval(phi, subject.posterior.interval_mass))),
        "draws": rounded(spread(phi)),
    }


def spread(phi: FloatArray) -> FloatArray:
    """Return ``DRAWS`` rows of draws (n, d), evenly among them; all where there are no more."""
    return phi[np.linspace(0, len(phi) - 1, min(DRAWS, len(phi))).astype(np.int64)]


def rounded(values: FloatArray) -> Any:  # noqa: ANN401
    """Return plain numbers of ``DIGITS`` significant digits, lists as the array is nested."""
    if values.ndim:
        return [rounded(row) for row in values]
    return float(f"{values:.{DIGITS}g}")
