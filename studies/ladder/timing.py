"""A setting of the forward model with physiological timing: the same equations, other fixed parameters.

The shipped setting contracts slowly and ejects briefly. What is fixed in it (muscle, valves, circulation,
passive wall) is searched by CMA-ES (Hansen 2006) so that beats at the prior's centre lie within the ranges of
healthy adults in every one of some contexts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from swesbi.base.arrays import FloatArray
from swesbi.base.progress import Progress
from swesbi.checks.cmaes import UNIT_CUBE, library_options
from swesbi.context import Context
from swesbi.heart.aorta import aortic_pressure_mmhg
from swesbi.heart.intervals import systolic_intervals
from swesbi.heart.periodic import Status
from swesbi.heart.physiology import TIME_CONSTANT
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import Beats, simulate
from swesbi.parameters import PHYSIOLOGY, PHYSIOLOGY_NAMES
from swesbi.prior import NuisanceSettings
from swesbi.seeds import generator

Range = tuple[float, float]
RANGES: Final[Mapping[str, Range]] = {
    # Asked of the setting.
    "ivct_ms": (40.0, 80.0),
    "lvet_ms": (260.0, 320.0),
    "ivrt_ms": (60.0, 110.0),
    "dpdt_mmhg_s": (1000.0, 2500.0),  # above 1000; the upper end is chosen
    "systolic_mmhg": (100.0, 130.0),
    "diastolic_mmhg": (60.0, 85.0),
    # A heart that keeps time must stay a heart: Lang et al. 2015 (both sexes), end-diastolic pressures of
    # health and a little more (chosen), the volume that the context says (chosen).
    "ejection_fraction": (0.52, 0.74),
    "end_diastolic_mmhg": (3.0, 16.0),
    "volume_ratio": (0.90, 1.10),
}
"""Ranges that beats should lie in, by quantity."""
SEARCHED: Final[Mapping[str, Range]] = {
    "sigma_0_pa": (6.0e4, 4.0e5),
    "destruction_alpha": (0.5, 12.5),
    "activation_onset_s": (0.015, 0.06),
    "activation_duration_s": (0.24, 0.42),
    "activation_ramp_s": (0.01, 0.08),  # one width for rise and fall: calcium falls more slowly than it rises
    "passive_c0_pa": (400.0, 6.0e3),
    "passive_c2_pa": (60.0, 900.0),
    "fibre_viscosity_pa_s": (20.0, 2.0e3),
    "mitral_resistance_pa_s_m3": (1.0e5, 3.0e6),
    "proximal_resistance_pa_s_m3": (2.0e6, 1.5e7),
    "distal_resistance_pa_s_m3": (8.0e7, 3.0e8),
    "systemic_capacitance_m3_pa": (3.0e-9, 2.0e-8),
    "pulmonary_capacitance_m3_pa": (4.0e-8, 3.0e-7),
    "initial_pulmonary_pressure_pa": (500.0, 2.5e3),
}
"""Bounds of the parameters that are searched, in the logarithm."""
FAILED: Final = 3.0
"""Distance, in widths of the range, of what a beat does not have."""
MARGIN: Final = 0.03
"""Share of a range's width by which the search stays inside it, so that rounding does not leave it."""
BOUNDS_SD: Final = 4.0
"""Bounds of nuisance parameters, in standard deviations of the logarithm."""
DECLARED: Final = {parameter.name: parameter.declared for parameter in PHYSIOLOGY}
NEARNESS: Final = 1e-4
"""Weight of the squared log change of a parameter from the shipped setting: what need not move stays."""


@dataclass(frozen=True)
class TimingSearch:
    """Effort of the search: one run for each seed, the best taken."""

    seeds: tuple[int, ...] = (1, 2)
    population_size: int = 16
    generations: int = 250
    step: float = 0.2


@dataclass(frozen=True)
class TimingFit:
    """The best setting, its loss, and the simulations that it took."""

    settings: ForwardModelSettings
    loss: float
    simulations: int


def quantities(beats: Beats, context: Context, settings: ForwardModelSettings) -> dict[str, FloatArray]:
    """Return what `RANGES` speaks of, of each beat; shape (n,). NaN where there is none.

    Pressures of the arteries are those at their root; dP/dt is the largest difference of
    neighbouring samples of the ventricular pressure.
    """
    times = systolic_intervals(beats, context.period_s)
    spacing_s = context.period_s / beats.cycle_phase.size
    pressure = beats.ventricular_pressure_mmhg
    root = aortic_pressure_mmhg(beats, settings)
    rise = (np.roll(pressure, -1, axis=1) - pressure).max(axis=1) / spacing_s
    return {
        "ivct_ms": 1e3 * times.isovolumic_contraction_s,
        "lvet_ms": 1e3 * times.ejection_s,
        "ivrt_ms": 1e3 * times.isovolumic_relaxation_s,
        "dpdt_mmhg_s": rise,
        "systolic_mmhg": root.max(axis=1),
        "diastolic_mmhg": root.min(axis=1),
        "ejection_fraction": beats.ejection_fraction,
        "end_diastolic_mmhg": pressure[:, 0],
        "volume_ratio": beats.end_diastolic_volume_ml / context.lvedv_ml,
    }


def reached(
    theta: FloatArray, contexts: Sequence[Context], settings: ForwardModelSettings
) -> dict[str, FloatArray]:
    """Return each quantity of `RANGES` at one theta (3,), of every context; NaN where there is no beat."""
    # every step is recorded: intervals to two milliseconds
    fine = settings.model_copy(update={"samples_per_beat": settings.steps_per_beat})
    rows = [_reached(theta, context, fine) for context in contexts]
    return {name: np.array([row[name] for row in rows]) for name in RANGES}


def _reached(theta: FloatArray, context: Context, settings: ForwardModelSettings) -> dict[str, float]:
    beats = simulate(theta[None], context, settings)
    if beats.status[0] != Status.PERIODIC:
        return dict.fromkeys(RANGES, float("nan"))
    return {name: float(value[0]) for name, value in quantities(beats, context, settings).items()}


def distance(values: FloatArray, limits: Range, margin: float = 0.0) -> FloatArray:
    """Return how far values (n,) lie outside a range, in its widths; 0 inside, ``FAILED`` where NaN.

    Args:
        values: Values of one quantity.
        limits: The range.
        margin: Share of the width by which the range is made narrower at both ends.
    """
    low, high = limits
    width = high - low
    outside = np.maximum(low + margin * width - values, values - high + margin * width) / width
    return np.where(np.isnan(values), FAILED, np.clip(outside, 0.0, FAILED))


def timing_loss(theta: FloatArray, contexts: Sequence[Context], settings: ForwardModelSettings) -> float:
    """Return the mean over contexts of the squared distances from all ranges, summed over quantities."""
    found = reached(theta, contexts, settings)
    return float(sum((distance(found[name], RANGES[name], MARGIN) ** 2).mean() for name in RANGES))


def with_searched(u: FloatArray, shipped: ForwardModelSettings) -> ForwardModelSettings:
    """Return the settings with the searched parameters at u in [0, 1]^k: low (high / low)^u each."""
    values = {
        name: float(low * (high / low) ** min(max(part, 0.0), 1.0))
        for (name, (low, high)), part in zip(SEARCHED.items(), u.tolist(), strict=True)
    }
    return shipped.model_copy(update=values)


def searched_of(settings: ForwardModelSettings) -> FloatArray:
    """Return u in [0, 1]^k of settings, the inverse of :func:`with_searched`; clipped to the bounds."""
    values = [
        np.log(getattr(settings, name) / low) / np.log(high / low) for name, (low, high) in SEARCHED.items()
    ]
    return np.asarray(np.clip(np.array(values), 0.0, 1.0))


def search_timing(
    theta: FloatArray, contexts: Sequence[Context], shipped: ForwardModelSettings, search: TimingSearch
) -> TimingFit:
    """Search the setting whose beats at theta (3,) lie within `RANGES` in every context.

    Args:
        theta: The prior's centre.
        contexts: Of the hearts that should keep time.
        shipped: The setting to start from; only `SEARCHED` parameters change.
        search: Effort.
    """
    progress = Progress("timing", len(search.seeds), unit="run")
    fits = []
    for seed in search.seeds:
        fits.append(_run(theta, contexts, shipped, search, seed))
        progress.step(note=f"seed {seed}: loss {fits[-1].loss:.5f}")
    best = min(fits, key=lambda fit: fit.loss)
    return TimingFit(best.settings, best.loss, sum(fit.simulations for fit in fits))


def _run(
    theta: FloatArray,
    contexts: Sequence[Context],
    shipped: ForwardModelSettings,
    search: TimingSearch,
    seed: int,
) -> TimingFit:
    import cma  # it loads pyplot

    start, rng = searched_of(shipped), generator(seed, "physiological timing")
    evolution = cma.CMAEvolutionStrategy(
        start, search.step, UNIT_CUBE | library_options(search.population_size, search.generations, rng)
    )
    widths = np.array([np.log(high / low) for low, high in SEARCHED.values()])
    best, loss, simulations = shipped, float("inf"), 0
    while not evolution.stop():
        population = evolution.ask()
        settings = [with_searched(u, shipped) for u in population]
        values = [
            timing_loss(theta, contexts, one) + NEARNESS * float((((u - start) * widths) ** 2).sum())
            for one, u in zip(settings, population, strict=True)
        ]
        simulations += len(contexts) * len(population)
        evolution.tell(population, values)
        if min(values) < loss:
            loss, best = min(values), settings[int(np.argmin(values))]
    return TimingFit(best, loss, simulations)


def rounded(settings: ForwardModelSettings) -> ForwardModelSettings:
    """Return the settings with the searched parameters to three digits, as a configuration would say them."""
    values = {name: float(f"{getattr(settings, name):.3g}") for name in SEARCHED}
    return settings.model_copy(update=values)


def moved_nuisances(
    settings: ForwardModelSettings, nuisances: NuisanceSettings
) -> dict[str, dict[str, float]]:
    """Return centre and bounds of the nuisance parameters that a searched setting moves.

    Widths stay, and bounds lie at four standard deviations, or where the forward model is declared no
    further; the passive wall is a factor of the setting's own, and stays at 1.

    Args:
        settings: The setting.
        nuisances: Priors about another.
    """
    time_constant_s = settings.distal_resistance_pa_s_m3 * settings.systemic_capacitance_m3_pa
    own = {name: getattr(settings, name) for name in SEARCHED} | {TIME_CONSTANT: time_constant_s}
    moved = {}
    for name, prior in nuisances.freed(PHYSIOLOGY_NAMES).items():
        if name in own:
            reach = float(np.exp(BOUNDS_SD * prior.log_sd))
            low, high = DECLARED[name]
            values = {
                "centre": own[name],
                "low": max(own[name] / reach, low),
                "high": min(own[name] * reach, high),
            }
            moved[name] = {key: float(f"{value:.3g}") for key, value in values.items()}
    return moved


def timing_table(
    theta: FloatArray, contexts: Sequence[Context], settings: ForwardModelSettings
) -> pd.DataFrame:
    """Return one row a quantity: its range, least, median and largest value, contexts inside, worst miss.

    ``outside`` names the contexts that lie outside; ``largest_miss`` is the largest distance from the
    range in the quantity's own unit.
    """
    found = reached(theta, contexts, settings)
    rows = []
    for name, (low, high) in RANGES.items():
        values = found[name]
        miss = distance(values, (low, high)) * (high - low)
        rows.append(
            {
                "quantity": name,
                "low": low,
                "high": high,
                "least": values.min(),
                "median": np.median(values),
                "largest": values.max(),
                "contexts": len(values),
                "inside": int((miss == 0.0).sum()),
                "largest_miss": miss.max(),
                "outside": " ".join(c.subject for c, far in zip(contexts, miss, strict=True) if far > 0.0),
            }
        )
    return pd.DataFrame(rows)
