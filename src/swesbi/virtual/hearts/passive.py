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


def fung_tangent(stretch: FloatArray, exponent_b: float) -> FloatArray:
    """Return d^2 W / d e^2 of Fung's energy W = exp(beta e^2) / (2 beta), e = (lambda^2 - 1) / 2 (Fung 1967).

    It is as stiff in compression as in stretch. beta = 7 b, so that at a stretch of 1.1 it is about as far
    above rest as the volunteers' law of exponent b.

    Args:
        stretch: lambda; any shape.
        exponent_b: b.
    """
    beta, squared = 7.0 * exponent_b, 0.25 * (stretch**2 - 1.0) ** 2
    return np.asarray((1.0 + 2.0 * beta * squared) * np.exp(beta * squared))


def recruited(stretch: FloatArray, exponent: float, share: float, resistance: float) -> FloatArray:
    """Return a matrix that resists compression, and collagen that stretch recruits; 1 at rest.

    Args:
        stretch: lambda; any shape.
        exponent: Of the collagen's rise with the strain lambda^2 - 1.
        share: Of the stiffness at rest that is the collagen's.
        resistance: Relative rise of the matrix a unit of compressive strain.
    """
    strain = stretch**2 - 1.0
    matrix = 1.0 + resistance * np.maximum(-strain, 0.0)
    return np.asarray((1.0 - share) * matrix + share * np.exp(exponent * np.maximum(strain, 0.0)))


def parabola(stretch: FloatArray, softest: float, rise: float) -> FloatArray:
    """Return 1 + A (lambda - lambda_0)^2: stiffest far from the stretch at which the wall is softest."""
    return np.asarray(1.0 + rise * (stretch - softest) ** 2)


def powers(stretch: FloatArray, tensile: float, compressive: float, ratio: float) -> FloatArray:
    """Return lambda^p + c lambda^-m, powers of the stretch as in Ogden's energies (Ogden 1972)."""
    return np.asarray(stretch**tensile + ratio * stretch**-compressive)


def acoustoelastic_kpa(stretch: FloatArray, settings: ForwardModelSettings) -> FloatArray:
    """Return 3 rho c^2 in kPa of a shear wave through the stretched wall, polarised across it.

    rho c^2 = lambda^2 sigma / (lambda^2 - lambda^-4), sigma the true stress in equibiaxial stretch (small
    waves on a finite deformation: Ogden 2007, Incremental statics and dynamics of pre-stressed elastic
    materials).

    Args:
        stretch: lambda; any shape.
        settings: The wall.
    """
    apart = np.where(np.abs(stretch - 1.0) < 1e-4, 1.0 + 1e-4, stretch)
    stress_kpa = 0.5e-3 * apart * wall_stress_pa(apart, settings, settings.passive_law)
    return np.asarray(3.0 * apart**2 * stress_kpa / (apart**2 - apart**-4))


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
