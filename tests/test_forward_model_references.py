"""The equations against independent simulators and closed forms."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from forward_model_cases import COHORT, SETTINGS

from swesbi.forward_model.model import build_model
from swesbi.forward_model.periodic import advance
from swesbi.forward_model.references import compare_with_physioblocks, compare_with_svzerod

REFERENCE = Path(__file__).parent / "reference" / "forward_model"


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
