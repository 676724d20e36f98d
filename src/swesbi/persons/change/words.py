"""Changes in words, of a person and of groups: ratios, verdicts, what all of it is conditional on."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.draws import median_and_interval
from swesbi.parameters import NUISANCES, THETA
from swesbi.persons.change.ratios import QUANTITIES, WORDS
from swesbi.persons.change.stored import StoredChange
from swesbi.persons.cohort.stored import NOTE_SEPARATOR, CohortPosterior

WIDTH: Final = 32
SURE: Final = 0.95
"""Probability from which a sentence calls a difference one."""
OF_QUANTITY: Final = dict(zip(QUANTITIES, WORDS, strict=True))
OF_NUISANCE: Final = {parameter.name: parameter.meaning for parameter in NUISANCES}


def change_lines(change: StoredChange) -> list[str]:
    """Return verdicts, ratios and certificate in lines."""
    return [
        f"{change.person}: {change.visit[0]} to {change.visit[1]}",
        *(f"  {line}" for line in verdict_lines(change)),
        *ratio_lines(change),
        certificate_line(change),
        shares_line(change),
    ]


def verdict_lines(change: StoredChange) -> list[str]:
    """Return the verdict of each visit and of the pair, and what has changed."""
    by_visit = [
        f"{visit} ({subject}): {verdict} by itself"
        for visit, subject, verdict in zip(change.visit, change.subject, change.verdict, strict=True)
    ]
    return [*by_visit, pair_line(change), changed_line(change)]


def pair_line(change: StoredChange) -> str:
    """Return whether both recordings can be of one person."""
    pair = change.one_person
    found = (
        f"p = {pair.p_value:.3f}, {pair.distance:.1f} posterior standard deviations apart in what is shared"
    )
    if pair.flagged:
        return (
            f"the two recordings are NOT of one person by what visits share ({found}); do not use the ratios"
        )
    return f"the two recordings can be of one person ({found})"


def changed_line(change: StoredChange) -> str:
    """Return what has changed, by the rule."""
    rule = (
        f"by more than {change.threshold:.0%} in one direction with probability above {change.probability:g}"
    )
    if not change.changed:
        return f"nothing has changed {rule}"
    return f"changed {rule}: {', '.join(OF_QUANTITY[name] for name in change.changed)}"


def ratio_rows(change: StoredChange) -> list[tuple[str, ...]]:
    """Return the table of ratios, its head first: texts, a row a quantity."""
    head = (
        "later / earlier", "median", f"{change.interval_mass:.0%} interval", "P(rise)",
        f"P(> {change.threshold:.0%})", "detectable", "narrower by",
    )  # fmt: skip
    ratios = change.ratios
    rows = [
        (
            OF_QUANTITY[name],
            f"{ratios.median[j]:.2f}",
            f"{ratios.low[j]:.2f} to {ratios.high[j]:.2f}",
            f"{ratios.rise[j]:.3f}",
            f"{ratios.changed[j]:.3f}",
            f"{ratios.detectable[j]:.0%}",
            f"{ratios.narrowing[j]:.0%}",
        )
        for j, name in enumerate(change.quantity)
    ]
    return [head, *rows]


def ratio_lines(change: StoredChange) -> list[str]:
    """Return the table of ratios in aligned lines."""
    return [
        f"{first:{WIDTH}}" + "".join(f"{text:>15}" for text in rest) for first, *rest in ratio_rows(change)
    ]


def certificate_line(change: StoredChange) -> str:
    """Return how reliable the joint draws are."""
    by, doubt = _draws(change)
    return (
        f"certificate: draws by {by}; of {change.weighted_draws} weighted draws {change.efficiency:.1%} "
        f"effective, k-hat {change.k_hat:.2f} (at most {change.k_hat_limit:.2f}){doubt}"
    )


def shares_line(change: StoredChange) -> str:
    """Return what visits share, as configured."""
    told = ", ".join(
        f"{OF_NUISANCE.get(name, f'{name} of the model')} {share:g}"
        for name, share in zip(change.share, change.shares, strict=True)
    )
    return (
        f"conditional on what visits are said to share (0 nothing, 1 all): {told}; all else is each "
        "visit's own"
    )


def group_lines(stored: CohortPosterior) -> list[str]:
    """Return what has changed in each group, how groups differ, how reliable that is, who was left out."""
    by, doubt = _draws(stored)
    compared = f"Groups are compared with {stored.reference_group}, the reference."
    return [
        *(line for j in range(len(THETA)) for line in _of_parameter(stored, j)),
        *([compared] if stored.groups else []),
        f"by {by}, k-hat {stored.k_hat:.2f}, {stored.efficiency:.0%} of the weighted draws effective{doubt}",
        *(f"{note[:1].upper()}{note[1:]}." for note in stored.notes.split(NOTE_SEPARATOR) if note),
    ]


def _of_parameter(stored: CohortPosterior, j: int) -> Iterator[str]:
    spread = float(np.exp(np.median(stored.population.spread[0, :, j])))
    names = stored.groups or (f"by {len(stored.member)} persons",)
    ratios = [
        f"{name} {_interval(stored.median_of(number)[:, j], stored.interval_mass)}"
        for number, name in enumerate(names)
    ]
    yield (
        f"{OF_QUANTITY[THETA[j].name]}: later over earlier, {'; '.join(ratios)}; two thirds of persons lie "
        f"within a factor of {spread:.2f} of the middle one."
    )
    for number, name in enumerate(stored.compared_group):
        draws = stored.population.group_factor[0, :, number, j]
        yield f"  {_difference(name, stored.reference_group, draws, stored.interval_mass)}"


def _difference(name: str, reference: str, draws: FloatArray, mass: float) -> str:
    above = float((draws > 1.0).mean())
    side, other, probability = ("more", "less", above) if above > 0.5 else ("less", "more", 1.0 - above)
    told = f"{name} over {reference}: {_interval(draws, mass)}"
    if probability < SURE:
        return f"{told}; that they differ is not told (higher with a probability of {above:.0%})."
    return (
        f"{told}: {name} rose {side} than {reference}, or fell {other}, with a probability of "
        f"{probability:.1%}."
    )


def _interval(draws: FloatArray, mass: float) -> str:
    low, median, high = median_and_interval(draws, mass)
    return f"{median:.2f} ({low:.2f} to {high:.2f})"


def _draws(stored: StoredChange | CohortPosterior) -> tuple[str, str]:
    """Return what gave the draws, and a warning where they are not reliable."""
    by = "MCMC" if stored.sampler == "mcmc" else "importance weights"
    return by, "" if stored.converged else "; NOT CONVERGED, do not use"
