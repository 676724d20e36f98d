"""Contexts drawn from the population, each from a random stream of its own.

Context number i is the same in every batch, shard and order: its stream depends on the study's seed, on what
the contexts are for, and on i alone.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Final, Literal

import numpy as np
from pydantic import ValidationError
from scipy.special import expit, logit

from swesbi.context import Context
from swesbi.population.settings import (
    DECLARED_NAMES,
    AgeCurve,
    BodySettings,
    GroupSettings,
    PopulationSettings,
    SizedQuantity,
    in_declared_range,
)
from swesbi.recording.settings import ContextRow
from swesbi.seeds import generator

LOGGER = logging.getLogger("swesbi")
MAX_ATTEMPTS: Final = 1000
"""A body that needs more draws has a distribution almost wholly outside the limits."""


@dataclass(frozen=True)
class DrawnContext:
    """One context and its group, and how many draws the limits refused before.

    If ``broad``, HR, LVEDV and IVSd were drawn over the whole declared range.
    """

    context: Context
    group: str
    broad: bool
    redrawn: int


def draw_contexts(
    index: Sequence[int], population: PopulationSettings, seed: int, *name: str | int, broad: bool = False
) -> tuple[Context, ...]:
    """Draw the contexts of these numbers for a purpose, as "training".

    Each number determines its context whatever the others. Where ``broad``, as in training, `broad_share` of
    them spread over the whole declared range.
    """
    drawn = draw_population(index, population, seed, *name, broad=broad)
    redrawn = sum(draw.redrawn for draw in drawn)
    if redrawn:
        LOGGER.info(
            "population: %d of %d draws outside the limits, drawn again", redrawn, redrawn + len(drawn)
        )
    return tuple(draw.context for draw in drawn)


def draw_population(
    index: Sequence[int], population: PopulationSettings, seed: int, *name: str | int, broad: bool = False
) -> tuple[DrawnContext, ...]:
    """Draw as :func:`draw_contexts` does, with the group of each and the number of refused draws."""
    return tuple(
        draw_one(number, population, generator(seed, "population", *name, number), broad) for number in index
    )


def draw_one(
    number: int, population: PopulationSettings, rng: np.random.Generator, broad: bool = False
) -> DrawnContext:
    """Draw the context of this number from a generator of the caller's."""
    # Group, sex, age and spread are kept when the body is drawn again: the limits do not change their shares.
    group = _choose_group(float(rng.random()), population)
    sex: Literal["F", "M"] = "M" if rng.random() < 0.5 else "F"
    age_years = float(rng.uniform(*population.groups[group].age_years))
    spread = bool(rng.random() < population.broad_share) and broad
    for attempt in range(MAX_ATTEMPTS):
        context = _body(number, sex, age_years, population.groups[group], rng)
        if spread:
            context = _spread(context, population, rng)
        if not in_declared_range(context, population) and is_plausible(context):
            return DrawnContext(context, group, spread, redrawn=attempt)
    raise RuntimeError(
        f"context {number} of the population (group {group}, sex {sex}, {age_years:.0f} years): outside the "
        f"limits in {MAX_ATTEMPTS} draws; compare its distributions with `declared_range`"
    )


def _choose_group(uniform: float, population: PopulationSettings) -> str:
    # By name: the order of a mapping is no part of the settings.
    names = sorted(population.groups)
    shares = np.cumsum([population.groups[name].share for name in names])
    return names[min(int(np.searchsorted(shares, uniform, side="right")), len(names) - 1)]


def _body(
    number: int, sex: Literal["F", "M"], age_years: float, group: GroupSettings, rng: np.random.Generator
) -> Context:
    body = group.body(sex)
    deviation = np.linalg.cholesky(np.array(group.correlation)) @ rng.standard_normal(5)
    bsa_m2 = float(np.exp(_log_median(body.bsa_m2, age_years) + body.bsa_m2.log_sd * deviation[0]))
    hr_bpm = float(np.exp(_log_median(body.hr_bpm, age_years) + body.hr_bpm.log_sd * deviation[1]))
    lvedv_ml = _sized(body.lvedv_ml, age_years, bsa_m2, deviation[2])
    return Context(
        subject=f"P{number + 1:06d}",
        sex=sex,
        age_years=age_years,
        bsa_m2=bsa_m2,
        hr_bpm=hr_bpm,
        lvedv_ml=lvedv_ml,
        lvesv_ml=lvedv_ml * (1.0 - _ejection_fraction(body, age_years, deviation[4])),
        ivsd_cm=_sized(body.ivsd_cm, age_years, bsa_m2, deviation[3]),
    )


def _log_median(curve: AgeCurve, age_years: float) -> float:
    return float(np.interp(age_years, curve.age_years, np.log(curve.median)))


def _sized(quantity: SizedQuantity, age_years: float, bsa_m2: float, deviation: float) -> float:
    growth = quantity.bsa_exponent * np.log(bsa_m2 / quantity.at_bsa_m2)
    return float(np.exp(_log_median(quantity, age_years) + growth + quantity.log_sd * deviation))


def _ejection_fraction(body: BodySettings, age_years: float, deviation: float) -> float:
    median = np.exp(_log_median(body.ejection_fraction, age_years))
    return float(expit(logit(median) + body.ejection_fraction.logit_sd * deviation))


def _spread(context: Context, population: PopulationSettings, rng: np.random.Generator) -> Context:
    """Replace what enters the simulator by draws over the declared range; BSA and EF stay."""
    limits = np.log([population.declared_range.limits(name) for name in DECLARED_NAMES])
    values = np.exp(rng.uniform(limits[:, 0], limits[:, 1])).tolist()
    drawn = dict(zip(DECLARED_NAMES, values, strict=True))
    return replace(context, **drawn, lvesv_ml=drawn["lvedv_ml"] * context.lvesv_ml / context.lvedv_ml)


def is_plausible(context: Context) -> bool:
    """Tell whether ingestion would take this context: the model's ranges, ejection fraction, LVEDV index."""
    try:
        ContextRow(**asdict(context))
    except ValidationError:
        return False
    return True
