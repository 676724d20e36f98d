"""A person's change in words: ratios, verdicts, and what all of it is conditional on."""

from __future__ import annotations

from typing import Final

from swesbi.parameters import NUISANCES
from swesbi.persons.change.ratios import QUANTITIES, WORDS
from swesbi.persons.change.stored import StoredChange

WIDTH: Final = 32
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
    by = "MCMC" if change.sampler == "mcmc" else "importance weights"
    doubt = "" if change.converged else "; NOT CONVERGED, do not use"
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
