"""What is not known of a heart: its prior with the reason, and how far it is learnt."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from swesbi.base.arrays import FloatArray
from swesbi.checks.identifiability.information import contraction
from swesbi.parameters import NUISANCES, PHI_NAMES, Parameter
from swesbi.prior import JointPriorSettings, NuisanceSettings, ParameterPrior, even_quantiles
from swesbi.report.numbers import MISSING, fixed, span
from swesbi.report.table import Table, markdown


@dataclass(frozen=True)
class Nuisance:
    """One nuisance parameter that is free.

    Attributes:
        parameter: Which.
        prior: Its prior.
        reason: Why its prior is what it is.
        contraction: 1 - var(log posterior) / var(log prior) in each of n posteriors; shape (n,).
    """

    parameter: Parameter
    prior: ParameterPrior
    reason: str
    contraction: FloatArray


def nuisances(prior: JointPriorSettings, posteriors: Sequence[FloatArray]) -> tuple[Nuisance, ...]:
    """Return the nuisance parameters that are free, in the order of the prior.

    Args:
        prior: Of phi.
        posteriors: Draws of phi, (m, d), of each of n subjects.
    """
    told = np.array([contraction(phi, even_quantiles(prior)).logarithm for phi in posteriors])
    told = told.reshape(len(posteriors), len(prior.names))
    known = {parameter.name: parameter for parameter in NUISANCES}
    start = len(PHI_NAMES)
    return tuple(
        Nuisance(known[name], prior.parameters[start + j], reason_of(name), told[:, start + j])
        for j, name in enumerate(prior.nuisance_names)
    )


def reason_of(name: str) -> str:
    """Return why a nuisance parameter has its prior: what follows the meaning of its setting."""
    return (NuisanceSettings.model_fields[name].description or "").partition(". ")[2]


def nuisances_part(free: Sequence[Nuisance]) -> str:
    """Show prior, contraction and reason of each; a dash where no posterior tells the contraction."""
    if not free:
        return "Nothing: every nuisance parameter is fixed."
    heads = ["Parameter", "Median", "Log sd", "Bounds", "Contraction", "Reason"]
    frame = pd.DataFrame([_row(nuisance) for nuisance in free], columns=heads)
    note = (
        "Contraction: 1 − posterior variance / prior variance of the logarithm, median over the subjects "
        "not contradicted, least and largest in brackets. Zero: the recording tells nothing."
    )
    return markdown(Table("What is not known of a heart.", frame, note=note))


def _row(nuisance: Nuisance) -> tuple[str, ...]:
    parameter, prior = nuisance.parameter, nuisance.prior
    centre, low, high = (_short(value) for value in (prior.centre, prior.low, prior.high))
    name = f"{parameter.meaning}, `{parameter.name}`"
    return (name, centre, _short(prior.log_sd), span(low, high), _told(nuisance.contraction), nuisance.reason)


def _short(value: float) -> str:
    """Return a number as a configuration has it: 1.5e8, 0.04."""
    return f"{value:g}".replace("e+0", "e")


def _told(contraction_of: FloatArray) -> str:
    if not len(contraction_of):
        return MISSING
    middle, low, high = (fixed(float(f(contraction_of)), 2) for f in (np.median, np.min, np.max))
    return f"{middle} ({span(low, high)})"
