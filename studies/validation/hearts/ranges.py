"""What other hearts are drawn from: contexts, physiology, mechanics, and the noise of their recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from swesbi.context import Context
from swesbi.parameters import ParameterPrior
from swesbi.population.contexts import draw_one, is_plausible
from swesbi.population.settings import PopulationSettings
from swesbi.recording.settings import AcquisitionSettings
from swesbi.virtual.generated import PHYSIOLOGY, Range
from swesbi.virtual.volunteers import COMMON

DrawContext = Callable[[int, np.random.Generator], Context]
"""Draws the context of the heart of this number."""
FACTOR: Final[Range] = (0.3, 3.0)
"""Of each viscosity and inertance against the volunteers' own, uniform in its logarithm."""
DRAWN_BY_FACTOR: Final = (
    "wall_viscosity_pa_s",
    "fibre_viscosity_pa_s",
    "mitral_inertance_pa_s2_m3",
    "aortic_inertance_pa_s2_m3",
)
THICK_SHARE: Final = 0.25
"""Share of the hearts of (b) with a thick septum; as many are dilated, the others come as they are drawn."""
THICK_IVSD_CM: Final[Range] = (1.1, 2.0)
# Severe dilatation begins at an LVEDV of 130 mL in women and 200 mL in men (Lang et al. 2015).
DILATED_LVEDV_ML: Final[Range] = (150.0, 300.0)
MAX_ATTEMPTS: Final = 1000
LOUD_FACTOR: Final = 2.0
"""Errors of (g) over those of the acquisition, and over the assumed width of the scale of the speeds."""
SHAPE_FACTOR: Final[Range] = (0.8, 1.2)
"""Of the passive stretch's excursion from one against the cavity's."""


def doubled(limits: Range) -> Range:
    """Return a range twice as wide in its logarithm, about its geometric middle."""
    low, high = limits
    ratio = float(np.sqrt(high / low))
    return low / ratio, high * ratio


DOUBLED: Final[Mapping[str, Range]] = {name: doubled(limits) for name, limits in PHYSIOLOGY.items()}
"""Physiology of (b)."""


def log_uniform(limits: Range, rng: np.random.Generator) -> float:
    """Draw a number that is uniform in its logarithm."""
    return float(np.exp(rng.uniform(*np.log(limits))))


def from_population(population: PopulationSettings) -> DrawContext:
    """Return what draws a context from the population."""

    def draw(index: int, rng: np.random.Generator) -> Context:
        return draw_one(index, population, rng).context

    return draw


def with_extremes(population: PopulationSettings) -> DrawContext:
    """Return what draws from the population, and thickens or dilates a share of the hearts.

    A body that admits no such heart is drawn again; whether the heart is to be thick or dilated is not.
    """

    def draw(index: int, rng: np.random.Generator) -> Context:
        kind = float(rng.random())
        for _ in range(MAX_ATTEMPTS):
            context = _changed(draw_one(index, population, rng).context, kind, rng)
            if is_plausible(context):
                return context
        raise RuntimeError(f"context {index}: no thick or dilated heart in {MAX_ATTEMPTS} bodies")

    return draw


def _changed(context: Context, kind: float, rng: np.random.Generator) -> Context:
    if kind < THICK_SHARE:
        return replace(context, ivsd_cm=log_uniform(THICK_IVSD_CM, rng))
    if kind < 2.0 * THICK_SHARE:
        lvedv_ml = log_uniform(DILATED_LVEDV_ML, rng)
        return replace(context, lvedv_ml=lvedv_ml, lvesv_ml=lvedv_ml * context.lvesv_ml / context.lvedv_ml)
    return context


def other_mechanics(rng: np.random.Generator) -> dict[str, object]:
    """Draw the mechanics of (c): length dependence, and viscosities and inertances by a factor each."""
    factors = {name: log_uniform(FACTOR, rng) for name in DRAWN_BY_FACTOR}
    drawn: dict[str, object] = {name: factor * float(COMMON[name]) for name, factor in factors.items()}
    return {"length_dependence": 1.0} | drawn


def louder(acquisition: AcquisitionSettings, speed_scale: ParameterPrior) -> AcquisitionSettings:
    """Return the acquisition of (g): larger errors of repeats and sweeps, and of the scale of all speeds.

    Inference assumes the width of that scale's prior.
    """
    changes = {
        "repeat_sd_fraction": LOUD_FACTOR * acquisition.repeat_sd_fraction,
        "sweep_fraction": LOUD_FACTOR * acquisition.sweep_fraction,
        "scale_fraction": LOUD_FACTOR * speed_scale.log_sd,
    }
    return acquisition.model_copy(update=changes)
