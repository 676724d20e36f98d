"""This model under the settings of two independent simulators, against their published output."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from swesbi.heart.equations import Options, Parameters
from swesbi.heart.model import Model, cavity_volume
from swesbi.heart.periodic import advance

Array = NDArray[np.float64]

PA_PER_MMHG: Final = 133.322387415


@dataclass(frozen=True)
class Comparison:
    """The same quantities from this model and from another program, at the same times."""

    program: str
    time_s: Array
    ours: Mapping[str, Array]
    theirs: Mapping[str, Array]

    def rmse(self, quantity: str) -> float:
        """Return the root mean square difference of one quantity, in the unit that its name ends with."""
        return float(np.sqrt(np.mean((self.ours[quantity] - self.theirs[quantity]) ** 2)))


def options(*chosen: str) -> Options:
    """Return the options of the model with these alone."""
    return Options(**{name: name in chosen for name in Options._fields})


def parameters(**used: float) -> Parameters:
    """Return the parameters of the model; those that are not used are one."""
    return Parameters(**dict.fromkeys(Parameters._fields, 1.0) | used)


PHYSIOBLOCKS_OPTIONS: Final = options(
    "active_stiffness", "length_dependence", "valve_inertance", "wall_inertia", "proximal_capacitance"
)
# PhysioBlocks 2.0.1, spherical_heart_forward_sim. Its node and backward conductances (5e-12) and its stiff
# series spring (1e8 Pa) are left out: this model's valves are tight and its spring is rigid.
PHYSIOBLOCKS_PARAMETERS: Final = parameters(
    radius=0.0340,
    thickness=0.0113,
    density=1000.0,
    c0=444.0,
    c1=2.9,
    c2=69.0,
    c3=6.5,
    wall_viscosity=70.0,
    fibre_viscosity=70.0,
    sigma_0=90e3,
    alpha=12.0,
    r_mitral=1.0 / 9e-6,
    r_aortic=1.0 / 1.3e-5,
    l_mitral=1e3,
    l_aortic=3e4,
    r_proximal=7e6,
    c_proximal=2e-10,
    r_distal=1.1e8,
    c_systemic=2.0 / 1.1e8,
    length_dependence=1.0,
)
PHYSIOBLOCKS_THETA: Final = (273e3, 35.0, 20.0)
PHYSIOBLOCKS_VENOUS_PRESSURE_PA: Final = 1600.0

SVZEROD_OPTIONS: Final = options(
    "thin_wall", "mooney_rivlin", "second_piola", "prescribed_flow", "wall_inertia"
)
# svZeroDSolver, test case chamber_sphere; its valves leak in a way of their own: the net flow is prescribed.
SVZEROD_PARAMETERS: Final = parameters(
    radius=0.05,
    thickness=0.01,
    density=1000.0,
    c0=1e4,
    c1=0.0,
    c2=40.0,
    c3=0.0,
    wall_viscosity=10.0,
    fibre_viscosity=0.0,
    sigma_0=185e3,
    alpha=0.0,
)
SVZEROD_THETA: Final = (1.0, 30.0, 30.0)
SVZEROD_WINDOW_S: Final = (0.17, 0.484, 0.005)


def physioblocks_model(table: pd.DataFrame, steps_per_ms: int = 1) -> Model:
    """Return the model of PhysioBlocks' spherical heart over the two beats of ``table``, from its first row.

    Activation rate and atrial pressure are the ones that the program used: u = 35 s - 20 (1 - s).
    """
    time_s = table["time_s"].to_numpy()
    steps = (time_s.size - 1) * steps_per_ms
    half_steps = np.linspace(time_s[0], time_s[-1], 2 * steps + 1)
    used_s = time_s - (time_s[1] - time_s[0])
    _, contraction, relaxation = PHYSIOBLOCKS_THETA
    rate = np.interp(half_steps, used_s, table["activation_rate_per_s"])
    drives = np.zeros((half_steps.size, 5))
    drives[:, 0] = (rate + relaxation) / (contraction + relaxation)
    drives[:, 1] = np.interp(half_steps, used_s, table["atrial_pressure_mmhg"]) * PA_PER_MMHG
    drives[:, 2] = PHYSIOBLOCKS_VENOUS_PRESSURE_PA
    first = table.iloc[0]
    start = np.array(
        [
            first["displacement_m"],
            first["active_stiffness_pa"],
            first["active_stress_pa"],
            first["arterial_pressure_mmhg"] * PA_PER_MMHG,
            0.0,
            max(first["mitral_flow_ml_s"], 0.0) * 1e-6,
            max(first["aortic_flow_ml_s"], 0.0) * 1e-6,
            first["proximal_pressure_mmhg"] * PA_PER_MMHG,
        ]
    )
    step_s = (time_s[-1] - time_s[0]) / steps
    options = PHYSIOBLOCKS_OPTIONS
    return Model(options, PHYSIOBLOCKS_PARAMETERS, drives, step_s, steps_per_ms, start, options)


def compare_with_physioblocks(table: pd.DataFrame, steps_per_ms: int = 1) -> Comparison:
    """Run beats 9 and 10 from the program's state at 8 s and compare beat 10."""
    model = physioblocks_model(table, steps_per_ms)
    _, record = advance(model.start[None], np.array([PHYSIOBLOCKS_THETA]), model)
    y, stiffness, _, pressure, mitral, aortic, _ = record[:, 0]
    beat = slice(model.samples // 2, model.samples)
    time_s = table["time_s"].to_numpy()[:-1]
    half_step_s = 0.5 * (time_s[1] - time_s[0])
    ours = {
        "volume_ml": 1e6 * cavity_volume(1.0 + y / model.parameters.radius, model),
        "ventricular_pressure_mmhg": np.interp(time_s + half_step_s, time_s, pressure) / PA_PER_MMHG,
        "active_stiffness_kpa": 1e-3 * stiffness,
        "aortic_flow_ml_s": 1e6 * aortic,
        "mitral_flow_ml_s": 1e6 * mitral,
    }
    table = table.assign(active_stiffness_kpa=1e-3 * table["active_stiffness_pa"])
    return Comparison(
        program="PhysioBlocks 2.0.1",
        time_s=time_s[beat],
        ours={name: values[beat] for name, values in ours.items()},
        theirs={name: table[name].to_numpy()[:-1][beat] for name in ours},
    )


def svzerod_model(table: pd.DataFrame) -> Model:
    """Return the model of svZeroDSolver's spherical chamber driven by the net flow of ``table``."""
    time_s = table["time_s"].to_numpy()
    steps = time_s.size - 1
    half_steps = np.linspace(time_s[0], time_s[-1], 2 * steps + 1)
    inflow = CubicSpline(time_s, table["inflow_m3_s"] - table["outflow_m3_s"])
    systole_s, diastole_s, steepness_s = SVZEROD_WINDOW_S
    rise = 1.0 + np.tanh((half_steps - systole_s) / steepness_s)
    fall = 1.0 - np.tanh((half_steps - diastole_s) / steepness_s)
    drives = np.zeros((half_steps.size, 5))
    drives[:, 0] = 0.25 * rise * fall
    drives[:, 3] = inflow(half_steps)
    drives[:, 4] = inflow(half_steps, 1)
    start = np.zeros(8)
    start[0] = table["radial_displacement_m"].iloc[0]
    start[2] = table["active_stress_pa"].iloc[0]
    step_s = (time_s[-1] - time_s[0]) / steps
    return Model(SVZEROD_OPTIONS, SVZEROD_PARAMETERS, drives, step_s, 1, start, SVZEROD_OPTIONS)


def compare_with_svzerod(table: pd.DataFrame) -> Comparison:
    """Run the chamber under the program's net flow and compare wall motion, pressure and active stress."""
    model = svzerod_model(table)
    _, record = advance(model.start[None], np.array([SVZEROD_THETA]), model)
    ours = {
        "radial_displacement_mm": 1e3 * record[0, 0],
        "ventricular_pressure_mmhg": record[3, 0] / PA_PER_MMHG,
        "active_stress_kpa": 1e-3 * record[6, 0],
    }
    theirs = {
        "radial_displacement_mm": 1e3 * table["radial_displacement_m"].to_numpy()[:-1],
        "ventricular_pressure_mmhg": table["ventricular_pressure_pa"].to_numpy()[:-1] / PA_PER_MMHG,
        "active_stress_kpa": 1e-3 * table["active_stress_pa"].to_numpy()[:-1],
    }
    return Comparison("svZeroDSolver", table["time_s"].to_numpy()[:-1], ours, theirs)
