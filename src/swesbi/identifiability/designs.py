"""What a subject's posterior would be after other recordings, and phases chosen for a cohort."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from swesbi.artefacts import Variable
from swesbi.identifiability.design import choose_phases, correlation, design_information, uniform_phases
from swesbi.identifiability.laplace import expected_variance, prior_precision
from swesbi.identifiability.quantities import log_gradient
from swesbi.identifiability.settings import DesignSettings
from swesbi.identifiability.speeds import SimulatedStencil, derivatives_at
from swesbi.parameters import THETA_NAMES
from swesbi.speed_model.model import SpeedModel

FloatArray = NDArray[np.float64]
NO_NOISE: Final = 1e-10
"""Squared relative standard error of infinitely many repeats: invertible even without a discrepancy."""


@dataclass(frozen=True)
class Designs:
    """Expected posterior sd of the log of q quantities, for N numbers of phases and R of repeats.

    Without any noise, the model's errors alone are left.
    """

    sd_log: Annotated[
        FloatArray,
        Variable(
            "quantity phases repeats", "1", "expected sd of the log; model errors of near phases correlated"
        ),
    ]
    sd_log_independent: Annotated[
        FloatArray, Variable("quantity phases repeats", "1", "the same with independent model errors")
    ]
    floor: Annotated[FloatArray, Variable("quantity phases", "1", "sd of the log without any noise")]
    floor_independent: Annotated[
        FloatArray, Variable("quantity phases", "1", "the same with independent model errors")
    ]


@dataclass(frozen=True)
class Placement:
    """Phases chosen for the whole cohort, and what they give beside even ones of the same number.

    The first n phases are the choice of n; ``counts`` are the numbers of phases compared.
    """

    phase: Annotated[FloatArray, Variable("choice", "1", "phases chosen, best first", group="placement")]
    counts: tuple[int, ...]
    sd_log: Annotated[
        FloatArray,
        Variable(
            "subject quantity placed",
            "1",
            "expected sd of the log with the first so many",
            group="placement",
        ),
    ]
    sd_log_even: Annotated[
        FloatArray,
        Variable("subject quantity placed", "1", "with as many, evenly spaced", group="placement"),
    ]


def expected_of_designs(
    model: SpeedModel,
    simulated: SimulatedStencil,
    duration_s: float,
    repeat_variance: float,
    settings: DesignSettings,
) -> Designs:
    """Judge evenly spaced designs for one subject.

    Args:
        model: Its recording's model.
        simulated: Posterior draws with their neighbours.
        duration_s: Duration of its activation.
        repeat_variance: Squared relative standard error of one repeat.
        settings: The designs.
    """
    variances = [*(repeat_variance / repeats for repeats in settings.repeats), NO_NOISE]
    correlated, independent = (
        np.stack(
            [
                _even(model, simulated, duration_s, variances, count, settings, reach)
                for count in settings.phases
            ],
            axis=1,
        )
        for reach in (settings.discrepancy_range_cycle, None)
    )
    return Designs(correlated[..., :-1], independent[..., :-1], correlated[..., -1], independent[..., -1])


def place_phases(
    models: Sequence[SpeedModel],
    simulated: Sequence[SimulatedStencil],
    durations_s: Sequence[float],
    noise_variances: Sequence[float],
    settings: DesignSettings,
) -> Placement:
    """Choose phases for a cohort, at its own repeats, for the three active parameters together.

    Args:
        models: One a subject.
        simulated: Posterior draws with their neighbours.
        durations_s: Durations of the activations.
        noise_variances: Squared relative standard error of each subject's mean speed at a phase.
        settings: Candidates, and how many to choose.
    """
    candidates = uniform_phases(settings.placement_candidates)
    at = [derivatives_at(model, one, candidates) for model, one in zip(models, simulated, strict=True)]
    discrepancy, prior = models[0].settings.discrepancy, models[0].settings.prior
    chosen = candidates[
        choose_phases(
            at,
            noise_variances,
            discrepancy,
            settings.discrepancy_range_cycle,
            prior_precision(prior),
            range(len(THETA_NAMES)),
            settings.placement_phases,
        )
    ]
    counts = tuple(count for count in settings.phases if count <= settings.placement_phases)
    parts = list(zip(models, simulated, durations_s, noise_variances, strict=True))
    reach = settings.discrepancy_range_cycle
    own = [
        np.stack([_sd(model, one, duration, [variance], [chosen[:n]], reach)[:, 0] for n in counts], axis=1)
        for model, one, duration, variance in parts
    ]
    even = [
        np.stack([_even(model, one, duration, [variance], n, settings, reach)[:, 0] for n in counts], axis=1)
        for model, one, duration, variance in parts
    ]
    return Placement(chosen, counts, np.stack(own), np.stack(even))


def _even(
    model: SpeedModel,
    simulated: SimulatedStencil,
    duration_s: float,
    variances: Sequence[float],
    count: int,
    settings: DesignSettings,
    reach: float | None,
) -> FloatArray:
    """Return the expected sd (q, noise levels) of evenly spaced phases, whatever the first one's place."""
    offsets = uniform_phases(settings.offsets)
    sets = [uniform_phases(count, offset) for offset in offsets]
    return _sd(model, simulated, duration_s, variances, sets, reach)


def _sd(
    model: SpeedModel,
    simulated: SimulatedStencil,
    duration_s: float,
    variances: Sequence[float],
    sets: Sequence[FloatArray],
    reach: float | None,
) -> FloatArray:
    """Return the root of the expected variance (q, noise levels), averaged over sets of phases and draws."""
    gradient = log_gradient(np.exp(simulated.log_phi[0]), duration_s)
    precision = prior_precision(model.settings.prior)
    expected = [
        expected_variance(precision, _information(model, simulated, phase, variances, reach), gradient)
        for phase in sets
    ]
    return np.asarray(np.sqrt(np.mean(expected, axis=(0, 2))).T)


def _information(
    model: SpeedModel,
    simulated: SimulatedStencil,
    phase: FloatArray,
    variances: Sequence[float],
    reach: float | None,
) -> FloatArray:
    """Return the information (noise levels, n, 4, 4); without a reach, model errors are independent."""
    at = derivatives_at(model, simulated, phase)
    together = np.eye(len(phase)) if reach is None else correlation(phase, reach)
    return design_information(at, variances, model.settings.discrepancy, together[None])
