"""Passive stiffness that the inference model does not have: the incremental modulus of the wall's own energy.

In equibiaxial stretch lambda of an incompressible wall with energy W, the true stress is
sigma = lambda W' / 2. Its increment by that of the logarithmic strain is, for a linear isotropic wall, twice
Young's modulus, so the modulus that a small biaxial deformation of the stretched wall meets is

    E(lambda) = (d sigma / d ln lambda) / 2 = (lambda W' + lambda^2 W'') / 4,

which at rest is W''(1) / 4, Young's modulus.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.heart.equations import Options, Parameters, passive_stress
from swesbi.heart.settings import ForwardModelSettings

STEP: Final = 1e-5
"""Of the central difference; the laws are smooth, so it is right to about nine digits."""
# W_2 over W_1 of the spherical chamber of svZeroDSolver, whose wall is of this law: 40 Pa over 10 kPa.
MOONEY_RATIO: Final = 4e-3
MATCHED_STRETCHES: Final = (0.85, 1.1)
"""About those of end systole and end diastole. A Mooney-Rivlin wall bears there what the own wall does, in
the geometric mean: no modulus fits both."""


def wall_stress_pa(stretch: FloatArray, settings: ForwardModelSettings, law: str) -> FloatArray:
    """Return W'(lambda) in Pa of the wall of these settings under a passive law; of the stretches' shape."""
    moduli = {"c0": settings.passive_c0_pa, "c1": settings.passive_c1}
    moduli |= {"c2": settings.passive_c2_pa, "c3": settings.passive_c3}
    parameters = Parameters(**{name: moduli.get(name, 0.0) for name in Parameters._fields})
    options = Options(**{name: name == law for name in Options._fields})
    stress = [passive_stress(value, parameters, options) for value in np.ravel(stretch).tolist()]
    return np.reshape(stress, np.shape(stretch))


def incremental_modulus_kpa(stretch: FloatArray, settings: ForwardModelSettings) -> FloatArray:
    """Return E(lambda) of the wall's own energy in kPa, for stretches of any shape; see the module."""

    def true_stress(at: FloatArray) -> FloatArray:
        return 0.5 * at * wall_stress_pa(at, settings, settings.passive_law)

    growth = np.exp(STEP)
    return np.asarray(1e-3 * 0.25 * (true_stress(stretch * growth) - true_stress(stretch / growth)) / STEP)


def mooney_rivlin_wall(settings: ForwardModelSettings) -> dict[str, object]:
    """Return the changes that make the wall one of Mooney-Rivlin which bears about what it bears now."""
    at = np.array(MATCHED_STRETCHES)
    unit = settings.model_copy(update={"passive_c0_pa": 1.0, "passive_c2_pa": MOONEY_RATIO})
    own, ours = (
        wall_stress_pa(at, settings, settings.passive_law),
        wall_stress_pa(at, unit, "mooney_rivlin"),
    )
    w_1 = float(np.exp(np.log(own / ours).mean()))
    return {"passive_law": "mooney_rivlin", "passive_c0_pa": w_1, "passive_c2_pa": MOONEY_RATIO * w_1}
