"""What the pressures of a cuff add to the answer on speeds: every quantity without and with them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Final

import numpy as np
import pandas as pd

from swesbi.artefacts.csv import Table
from swesbi.artefacts.typed import ByPlace, BySubject
from swesbi.base.arrays import FloatArray
from swesbi.context import Context
from swesbi.draws import median_and_interval
from swesbi.heart.physiology import CAPACITANCE, TIME_CONSTANT
from swesbi.heart.simulate import simulate_active
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.measurement.operator import active_stiffness_map
from swesbi.parameters import OF_THETA, PEAK_ACTIVE
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.observation import Observation

RESISTANCE: Final = "distal_resistance_pa_s_m3"
SIMULATED: Final = 1000
"""Draws of a posterior whose beats are simulated: limits to a tenth of the posterior sd."""
COLUMNS: Final = (
    "experiment", "subject", "quantity", "without_median", "without_low", "without_high", "with_median",
    "with_low", "with_high", "width_ratio", "shift_in_widths", "sbp_mmhg", "dbp_mmhg", "sampler",
    "efficiency", "k_hat", "converged",
)  # fmt: skip
PRESSURES: Final = Table(columns=COLUMNS, row="subject")
PressuresTable = Annotated[pd.DataFrame, PRESSURES]
"""``pressures.csv``."""


def pressures_table(
    observations: BySubject[Observation],
    posteriors: ByPlace[ExactPosterior],
    with_pressures: ByPlace[ExactPosterior],
    *,
    population_models: dict[str, SpeedModelSettings],
) -> PressuresTable:
    """Tabulate what pressures add to each subject that has them: a row a subject and quantity.

    Medians and equal-tailed intervals, without pressures and with them; width_ratio, log high / low with over
    that without; shift_in_widths, log of the medians' ratio over the latter; then the pressures and how the
    posterior with them was obtained. ``population_models`` are the models of a recording by experiment.
    """
    rows = [
        {"experiment": place.experiment} | row
        for place, found in with_pressures.items()  # one by one: posteriors of many subjects fill the memory
        for row in _rows(
            observations[place.subject], population_models[place.experiment], posteriors[place], found
        )
    ]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _rows(
    observation: Observation, model: SpeedModelSettings, without: ExactPosterior, found: ExactPosterior
) -> list[dict[str, object]]:
    context, clinical = observation.context, observation.clinical
    before, after = (quantities(model, posterior.phi, context) for posterior in (without, found))
    how: dict[str, object] = {
        "subject": context.subject,
        "sbp_mmhg": clinical.sbp_mmhg,
        "dbp_mmhg": clinical.dbp_mmhg,
        "sampler": found.sampler,
        "efficiency": found.efficiency,
        "k_hat": found.k_hat,
        "converged": found.converged,
    }
    return [
        how | {"quantity": name} | _row(before[name], values, found.interval_mass)
        for name, values in after.items()
    ]


def quantities(model: SpeedModelSettings, phi: FloatArray, context: Context) -> Mapping[str, FloatArray]:
    """Return draws of every quantity that a posterior reports, by name; peak active stiffness of fewer draws.

    The parameters by their own names, the peak active stiffness behind those that are reported, and the
    compliance of the arteries where resistance and time constant are free.
    """
    columns = dict(zip(model.prior.names, phi.T, strict=True))
    if RESISTANCE in columns and TIME_CONSTANT in columns:
        columns[CAPACITANCE] = columns[TIME_CONSTANT] / columns[RESISTANCE]
    return {PEAK_ACTIVE.name: _shown(model, phi[:SIMULATED], context), **columns}


def _shown(model: SpeedModelSettings, phi: FloatArray, context: Context) -> FloatArray:
    """Return the peak active stiffness of draws in kPa; those that have no beat are left out."""
    beats = simulate_active(phi[:, OF_THETA], context, model.forward_model, model.physiology(phi))
    active = active_stiffness_map(model.measurement.active_stiffness_map)
    shown = active(beats.active_stiffness_kpa).max(axis=1)
    return np.asarray(shown[np.isfinite(shown)])


def _row(before: FloatArray, after: FloatArray, mass: float) -> dict[str, object]:
    without, found = median_and_interval(before, mass), median_and_interval(after, mass)
    width = np.log(without[2] / without[0])
    names = ("low", "median", "high")
    return {
        **{f"with_{name}": value for name, value in zip(names, found, strict=True)},
        **{f"without_{name}": value for name, value in zip(names, without, strict=True)},
        "width_ratio": np.log(found[2] / found[0]) / width,
        "shift_in_widths": np.log(found[1] / without[1]) / width,
    }
