"""What is not known of a heart: its prior with the reason in the configuration, and how far it is learnt."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import yaml

from swesbi.base.arrays import FloatArray
from swesbi.checks.identifiability.information import contraction
from swesbi.parameters import NUISANCES, PHI_NAMES, Parameter
from swesbi.prior import JointPriorSettings, ParameterPrior, even_quantiles
from swesbi.report.numbers import MISSING, fixed, span
from swesbi.report.table import Column, Table, body, markdown, words

AS_ABOVE: Final = "as above"


@dataclass(frozen=True)
class Nuisance:
    """One nuisance parameter that is free.

    Attributes:
        parameter: Which.
        prior: Its prior.
        reason: What stands beside it in the configuration; empty where nothing does.
        contraction: 1 - var(log posterior) / var(log prior) in each of n posteriors; shape (n,).
    """

    parameter: Parameter
    prior: ParameterPrior
    reason: str
    contraction: FloatArray


def nuisances(
    prior: JointPriorSettings, reasons: Mapping[str, str], posteriors: Sequence[FloatArray]
) -> tuple[Nuisance, ...]:
    """Return the nuisance parameters that are free, in the order of the prior.

    Args:
        prior: Of phi.
        reasons: Of priors, by name; see :func:`reasons_of`.
        posteriors: Draws of phi, (m, d), of each of n subjects.
    """
    told = np.array([contraction(phi, even_quantiles(prior)).logarithm for phi in posteriors])
    told = told.reshape(len(posteriors), len(prior.names))
    known = {parameter.name: parameter for parameter in NUISANCES}
    start = len(PHI_NAMES)
    return tuple(
        Nuisance(known[name], prior.parameters[start + j], reasons.get(name, ""), told[:, start + j])
        for j, name in enumerate(prior.nuisance_names)
    )


def reasons_of(config: str, prior: str) -> dict[str, str]:
    """Return the comment above each nuisance parameter of a prior, which serves those below it too.

    Args:
        config: Text of the configuration, where comments say the reason of a value.
        prior: Name of the prior.
    """
    node = yaml.compose(config, Loader=yaml.SafeLoader)
    for key in ("priors", prior, "nuisances"):
        node = _below(node, key)
    if not isinstance(node, yaml.MappingNode):
        return {}
    lines, found, last = config.splitlines(), {}, ""
    for key, _ in node.value:
        last = _comment_above(lines, key.start_mark.line) or last
        found[str(key.value)] = last
    return found


def _below(node: yaml.Node | None, key: str) -> yaml.Node | None:
    pairs = node.value if isinstance(node, yaml.MappingNode) else []
    return next((value for name, value in pairs if name.value == key), None)


def _comment_above(lines: Sequence[str], line: int) -> str:
    """Return the comment lines that end above this line as one text."""
    start = line
    while start > 0 and lines[start - 1].lstrip().startswith("#"):
        start -= 1
    return " ".join(each.strip().removeprefix("#").strip() for each in lines[start:line])


def nuisances_part(free: Sequence[Nuisance]) -> str:
    """Show prior, contraction and reason of each; a dash where no posterior tells the contraction."""
    if not free:
        return "Nothing: every nuisance parameter is fixed."
    prior = (Column("Median"), Column("Log sd"), Column("Bounds"))
    columns = (*words("Parameter"), *prior, Column("Contraction"), *words("Reason"))
    rows, last = [], ""
    for nuisance in free:
        repeated = nuisance.reason and nuisance.reason == last
        rows.append(_row(nuisance, AS_ABOVE if repeated else nuisance.reason or MISSING))
        last = nuisance.reason
    note = (
        "Contraction: 1 − posterior variance / prior variance of the logarithm, median over the subjects "
        "that are not unsupported, least and largest in brackets. Zero: the recording tells nothing."
    )
    return markdown(Table("What is not known of a heart.", columns, body(rows), note))


def _row(nuisance: Nuisance, reason: str) -> tuple[str, ...]:
    parameter, prior = nuisance.parameter, nuisance.prior
    centre, low, high = (_short(value) for value in (prior.centre, prior.low, prior.high))
    name = f"{parameter.meaning}, `{parameter.name}`"
    return (name, centre, _short(prior.log_sd), span(low, high), _told(nuisance.contraction), reason)


def _short(value: float) -> str:
    """Return a number as a configuration has it: 1.5e8, 0.04."""
    return f"{value:g}".replace("e+0", "e")


def _told(contraction_of: FloatArray) -> str:
    if not len(contraction_of):
        return MISSING
    middle, low, high = (fixed(float(f(contraction_of)), 2) for f in (np.median, np.min, np.max))
    return f"{middle} ({span(low, high)})"
