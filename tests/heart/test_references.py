"""The equations against independent simulators and closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from forward_model_cases import COHORT, SETTINGS
from references import SVZEROD_OPTIONS, SVZEROD_PARAMETERS, compare_with_physioblocks, compare_with_svzerod
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from study_copy import ROOT

from swesbi.heart.equations import cavity, passive_stress, viscosity
from swesbi.heart.model import build_model
from swesbi.heart.periodic import advance

REFERENCE = ROOT / "tests" / "reference" / "forward_model"


@pytest.mark.parametrize(
    ("quantity", "largest_rmse"),
    [
        ("volume_ml", 0.2),
        ("ventricular_pressure_mmhg", 0.2),
        ("active_stiffness_kpa", 0.5),
        ("aortic_flow_ml_s", 2.5),
        ("mitral_flow_ml_s", 1.0),
    ],
)
def test_physioblocks_beat_ten(quantity: str, largest_rmse: float) -> None:
    table = pd.read_csv(REFERENCE / "physioblocks_spherical_heart.csv.gz")
    rmse = compare_with_physioblocks(table).rmse(quantity)
    print(f"{quantity}: RMSE {rmse:.3f}")
    assert rmse <= largest_rmse


@pytest.mark.parametrize(
    ("quantity", "largest_rmse"),
    [("radial_displacement_mm", 0.005), ("ventricular_pressure_mmhg", 0.15), ("active_stress_kpa", 0.001)],
)
def test_svzerod_chamber(quantity: str, largest_rmse: float) -> None:
    table = pd.read_csv(REFERENCE / "svzerod_chamber_sphere.csv.gz")
    rmse = compare_with_svzerod(table).rmse(quantity)
    print(f"{quantity}: RMSE {rmse:.2g}")
    assert rmse <= largest_rmse


@pytest.mark.parametrize("activation", [0.0, 1.0])
def test_active_stiffness_closed_form(activation: float) -> None:
    """Without bond destruction by strain, k_c is an exponential towards k_0 or towards 0."""
    k_0, k_atp, k_sr = 45e3, 5.0, 30.0
    model = build_model(COHORT["A"], SETTINGS.model_copy(update={"destruction_alpha": 0.0}))
    drives = model.drives.copy()
    drives[:, 0] = activation
    start = model.start.copy()
    start[1] = 0.0 if activation else k_0
    model = replace(model, drives=drives, start=start)
    _, record = advance(start[None], np.array([[k_0, k_atp, k_sr]]), model)
    t = np.arange(model.samples) * model.step_s * model.stride
    exact = k_0 * (1.0 - np.exp(-k_atp * t)) if activation else k_0 * np.exp(-k_sr * t)
    np.testing.assert_allclose(record[1, 0], exact, rtol=1e-4, atol=0.0)


def test_svzerod_chamber_moves_under_its_pressure() -> None:
    """The wall's law as an equation of motion: the program's pressure and stress in, its displacement out."""
    table = pd.read_csv(REFERENCE / "svzerod_chamber_sphere.csv.gz")
    p, o = SVZEROD_PARAMETERS, SVZEROD_OPTIONS
    time_s = table["time_s"].to_numpy()
    pressure = CubicSpline(time_s, table["ventricular_pressure_pa"])
    active = CubicSpline(time_s, table["active_stress_pa"])

    def rates(t: float, x: np.ndarray) -> list[float]:
        stretch = 1.0 + x[0] / p.radius
        _, v_y, _ = cavity(stretch, p, o)
        stress = passive_stress(stretch, p, o) + viscosity(stretch, p) * x[1] / p.radius + stretch * active(t)
        load = pressure(t) * v_y / (4.0 * np.pi * p.radius**2)
        return [x[1], (load - p.thickness / p.radius * stress) / (p.density * p.thickness)]

    speed = np.gradient(table["radial_displacement_m"], time_s)[0]
    start = [table["radial_displacement_m"].iloc[0], speed]
    solution = solve_ivp(
        rates, time_s[[0, -1]], start, method="LSODA", t_eval=time_s, rtol=1e-8, atol=1e-12, max_step=1e-3
    )
    rmse_mm = 1e3 * np.sqrt(np.mean((solution.y[0] - table["radial_displacement_m"]) ** 2))
    print(f"displacement under the given pressure: RMSE {rmse_mm:.2g} mm")
    assert rmse_mm <= 0.005
