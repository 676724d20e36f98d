"""What came out of the validation: a generator's rows, which comes first, and what is reached, in sentences.

Generators stand worst first: those that miss what is asked, then those that are not tested, then the others.
matplotlib is not imported.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import pandas as pd

from swesbi.parameters import BONDS, DERIVED, SHOWN
from swesbi.report.numbers import PARAMETERS, count, percent, share
from swesbi.report.results import records

QUANTITIES: Final = (
    SHOWN.name,
    "k_sr_per_s",
    "duration_ms",
    "peak_kpa",
    "decay_rate_per_s",
    "half_relaxation_ms",
    BONDS.name,
    "k0_kpa",
    "k_atp_per_s",
)
"""What is scored, a row each of a generator that has it."""
SCORED: Final = 2
"""The first of them, shown stiffness and k_SR, make a heart missed."""
TESTED: Final = "tested"
NOT_TESTED: Final = "not tested"
ASKED: Final = (0.85, 0.95)
"""Coverage that is asked of 90 % intervals."""
MOST_MISSED: Final = 0.15
"""Largest share missed of the hearts not contradicted."""
NAMES: Final = {quantity.name: quantity.meaning for quantity in DERIVED} | PARAMETERS
OF_EVERY_GENERATOR: Final = QUANTITIES[:SCORED]
"""Quantities whose coverage is asked of every generator: shown stiffness and k_SR."""


@dataclass(frozen=True)
class Aim:
    """What is asked besides of a generator that shares its equations with the model.

    Attributes:
        not_contradicted: Least share of hearts not contradicted.
        most_covered: Largest coverage of each of the four quantities.
    """

    not_contradicted: float
    most_covered: float


AIMS: Final = {"a": Aim(0.8, 1.0), "b": Aim(0.6, ASKED[1])}
"""By letter; the least coverage is ``ASKED[0]``."""


@dataclass(frozen=True)
class Outcome:
    """What came out for one generator.

    Attributes:
        generator: Its letter and title, as the table has them ("a: generator of the study").
        rows: Its rows of the table, by quantity; every generator has shown stiffness.
    """

    generator: str
    rows: Mapping[str, Mapping[Any, Any]]

    @property
    def letter(self) -> str:
        """Its letter."""
        return self.generator.partition(":")[0]

    @property
    def label(self) -> str:
        """Letter and title as text has them: "(a) generator of the study"."""
        return f"({self.letter}) {self.generator.partition(': ')[2]}"

    @property
    def of_hearts(self) -> Mapping[Any, Any]:
        """The row that says what is true of all its hearts: that of shown stiffness."""
        return self.rows[SHOWN.name]

    @property
    def not_contradicted(self) -> float:
        """Share of its hearts that are not contradicted."""
        return float(self.of_hearts["not_contradicted"])

    @property
    def tested(self) -> bool:
        """Whether enough of its hearts are not contradicted."""
        return is_tested(self.of_hearts)

    @property
    def missed(self) -> float:
        """Share of its hearts not contradicted that are missed; NaN where it is not tested."""
        return float(self.of_hearts["missed_not_contradicted"])

    @property
    def covered(self) -> dict[str, float]:
        """Coverage, of hearts not contradicted, of each quantity that is asked and tested."""
        rows = {name: self.rows[name] for name in OF_EVERY_GENERATOR if name in self.rows}
        return {name: float(row["coverage_not_contradicted"]) for name, row in rows.items() if is_tested(row)}

    @property
    def reached(self) -> bool:
        """Whether it is tested, and each of them is as large as is asked."""
        return self.tested and min(self.covered.values()) >= ASKED[0]


def is_tested(row: Mapping[Any, Any]) -> bool:
    """Return whether a row of the table says something of the hearts not contradicted."""
    return str(row["tested"]) == TESTED


def outcomes(table: pd.DataFrame) -> tuple[Outcome, ...]:
    """Return what came out for each generator of ``validation.csv``, worst first.

    Args:
        table: Its rows.
    """
    found = [
        Outcome(str(name), {str(row["quantity"]): row for row in records(rows)})
        for name, rows in table.groupby("generator", sort=True)
    ]
    return tuple(sorted(found, key=_order))


def _order(outcome: Outcome) -> tuple[int, float]:
    """Return the place of a generator: missed, not tested, reached; the least share first among them."""
    if not outcome.tested:
        return 1, outcome.not_contradicted
    return (2 if outcome.reached else 0), min(outcome.covered.values())


def in_brief(table: pd.DataFrame) -> tuple[str, ...]:
    """Return in sentences which generators miss what is asked, which are not tested, and which reach it.

    Asked of each: shown stiffness and k_SR in their intervals in at least 85 % of the hearts not
    contradicted, at most 15 % of these missed; of (a) and (b) also what ``AIMS`` says. Worst first.

    Args:
        table: Rows of ``validation.csv``.
    """
    return tuple(_sentences(outcomes(table)))


def _sentences(found: Sequence[Outcome]) -> Iterator[str]:
    asked = f"{share(ASKED[0], 0)} of the hearts not contradicted"
    tested = [outcome for outcome in found if outcome.tested]
    if failed := [outcome for outcome in tested if not outcome.reached]:
        yield f"The interval holds the truth in fewer than {asked}: {_listed(failed, _below)}."
    if missed := [outcome for outcome in tested if outcome.missed > MOST_MISSED]:
        worst = sorted(missed, key=lambda outcome: -outcome.missed)
        listed = _listed(worst, lambda outcome: share(outcome.missed))
        yield f"More than {share(MOST_MISSED, 0)} missed and not contradicted: {listed}."
    if untested := [outcome for outcome in found if not outcome.tested]:
        yield f"Not tested, since too few hearts are not contradicted: {_listed(untested, _counted)}."
    yield from (_aimed(outcome, AIMS[outcome.letter]) for outcome in found if outcome.letter in AIMS)
    if reached := [outcome for outcome in tested if outcome.reached]:
        yield f"The intervals hold shown stiffness and k_SR in at least {asked}: {_listed(reached, _all)}."


def _listed(found: Sequence[Outcome], said: Callable[[Outcome], str]) -> str:
    return "; ".join(f"{outcome.label}, {said(outcome)}" for outcome in found)


def _below(outcome: Outcome) -> str:
    return _shares({name: value for name, value in outcome.covered.items() if value < ASKED[0]})


def _all(outcome: Outcome) -> str:
    return _shares(outcome.covered)


def _counted(outcome: Outcome) -> str:
    return f"{count(outcome.of_hearts['n_not_contradicted'])} of {count(outcome.of_hearts['n'])}"


def _shares(values: Mapping[str, float]) -> str:
    """Return shares of quantities, the least first: "k_SR 71.0 %, shown stiffness 80.0 %"."""
    ordered = sorted(values.items(), key=lambda item: item[1])
    return ", ".join(f"{NAMES[name]} {share(value)}" for name, value in ordered)


def _aimed(outcome: Outcome, aim: Aim) -> str:
    """Say what is asked besides of a generator of the model's own equations, and what came out."""
    covered = {name: float(row["coverage"]) for name, row in outcome.rows.items()}
    outside = {name: one for name, one in covered.items() if not ASKED[0] <= one <= aim.most_covered}
    asked = f"{percent(ASKED[0], 0)} to {share(aim.most_covered, 0)}"
    enough = "at least" if outcome.not_contradicted >= aim.not_contradicted else "fewer than the asked"
    quantities = f"outside {asked} lie {_shares(outside)}" if outside else f"each quantity in {asked}"
    return (
        f"{outcome.label}: {share(outcome.not_contradicted)} not contradicted, {enough} "
        f"{share(aim.not_contradicted, 0)}; of all answered hearts {quantities}."
    )
