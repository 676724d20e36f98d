"""What came out of the validation: a generator's rows, which comes first, and what is reached, in sentences.

Pooled rows stand first. Generators that miss what is asked follow, then those that are not tested, then the
others. matplotlib is not imported.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import pandas as pd

from swesbi.parameters import BONDS, DERIVED, SHOWN
from swesbi.report.numbers import PARAMETERS, as_percent, count, fixed, percent, share, span
from swesbi.report.results import records

K_SR: Final = "k_sr_per_s"
QUANTITIES: Final = (
    SHOWN.name,
    K_SR,
    "duration_ms",
    "peak_kpa",
    "decay_rate_per_s",
    "half_relaxation_ms",
    "late_diastole_kpa",
    BONDS.name,
    "k0_kpa",
    "k_atp_per_s",
)
"""What is scored, a row each of a generator that has it."""
SCORED: Final = 2
"""The first of them, shown stiffness and k_SR, make a heart missed."""
OF_EVERY_GENERATOR: Final = QUANTITIES[:SCORED]
"""Quantities of which a coverage is asked: shown stiffness and k_SR."""
NAMES: Final = {quantity.name: quantity.meaning for quantity in DERIVED} | PARAMETERS
TESTED: Final = "tested"
NOT_TESTED: Final = "not tested"

CONFIDENCE: Final = 0.99
"""Level of the Clopper-Pearson intervals by which rates are read."""
EACH: Final = ("a", "b", "c", "d", "h")
"""Generators of each of which a coverage is asked."""
REACHED: Final = 0.90
"""Coverage that the interval of each must reach: what 90 % intervals of a calibrated system cover."""
TOGETHER: Final = ("c", "d", "h")
"""Generators with another structure than the model's, of which more is asked together."""
LEAST_TOGETHER: Final = 0.85
"""Least coverage of these together."""
MOST_MISSED: Final = 0.23
"""Largest share missed of these together."""
BY_CHANCE: Final = round(1.0 - REACHED**SCORED, 2)
"""Share that two independent calibrated 90 % intervals miss."""
STRANGER: Final = "f"
"""The generator whose hearts the verdict must contradict."""
MOST_STRANGERS: Final = 0.10
"""Largest share of its hearts that are not contradicted."""
WIDEST: Final = 1.35
"""Largest width of k_SR on (a), in widths of the second sitting."""

POOLED: Final = "pooled"
POOLED_TOGETHER: Final = f"{POOLED}: {', '.join(TOGETHER)}"
POOLED_ALL: Final = f"{POOLED}: all"
"""What the table calls the hearts of several generators together."""


@dataclass(frozen=True)
class Outcome:
    """What came out for one generator, or for several together.

    Attributes:
        generator: Its letter and title, as the table has them ("a: generator of the study").
        rows: Its rows of the table, by quantity; at least one.
    """

    generator: str
    rows: Mapping[str, Mapping[Any, Any]]

    @property
    def letter(self) -> str:
        """Its letter, or "pooled"."""
        return self.generator.partition(":")[0]

    @property
    def pooled(self) -> bool:
        """Whether it is of several generators together."""
        return self.letter == POOLED

    @property
    def label(self) -> str:
        """Letter and title as text has them: "(a) generator of the study"; or "(c), (d), (h) together"."""
        title = self.generator.partition(": ")[2]
        if not self.pooled:
            return f"({self.letter}) {title}"
        return "all together" if self.generator == POOLED_ALL else f"{lettered(title.split(', '))} together"

    @property
    def of_hearts(self) -> Mapping[Any, Any]:
        """The row that says what is true of all its hearts: its first."""
        return next(self.rows[name] for name in QUANTITIES if name in self.rows)

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
    def short(self) -> tuple[str, ...]:
        """Quantities that are covered less than is asked of it."""
        return tuple(name for name in self.covered if falls_short(self.generator, name, self.rows[name]))


def lettered(letters: Sequence[str]) -> str:
    """Return letters as text has them: "(c), (d), (h)"."""
    return ", ".join(f"({letter})" for letter in letters)


def is_tested(row: Mapping[Any, Any]) -> bool:
    """Return whether a row of the table says something of the hearts not contradicted."""
    return str(row["tested"]) == TESTED


def falls_short(generator: str, quantity: str, row: Mapping[Any, Any]) -> bool:
    """Return whether a coverage of hearts not contradicted is less than is asked; never where none is asked.

    Args:
        generator: As the table has it.
        quantity: Its name.
        row: The row of the table.
    """
    if quantity not in OF_EVERY_GENERATOR or not is_tested(row):
        return False
    if generator == POOLED_TOGETHER:
        return float(row["coverage_not_contradicted"]) < LEAST_TOGETHER
    return generator[:1] in EACH and float(row["coverage_not_contradicted_high"]) < REACHED


def missed_too_often(generator: str, row: Mapping[Any, Any]) -> bool:
    """Return whether more hearts are missed than is asked; arguments as of :func:`falls_short`."""
    if not is_tested(row):
        return False
    if generator == POOLED_TOGETHER:
        return float(row["missed_not_contradicted"]) > MOST_MISSED
    return generator[:1] in EACH and float(row["missed_not_contradicted_low"]) > BY_CHANCE


def outcomes(table: pd.DataFrame) -> tuple[Outcome, ...]:
    """Return what came out for each generator of ``validation.csv``, in the order above.

    Args:
        table: Its rows.
    """
    found = [
        Outcome(str(name), {str(row["quantity"]): row for row in records(rows)})
        for name, rows in table.groupby("generator", sort=True)
    ]
    return tuple(sorted(found, key=_order))


def _order(outcome: Outcome) -> tuple[int, float]:
    """Return the place: pooled, missed, not tested, the rest; the least share first among them."""
    if outcome.pooled:
        return 0, float(outcome.generator == POOLED_ALL)
    if not outcome.tested:
        return 2, outcome.not_contradicted
    wrong = outcome.short or missed_too_often(outcome.generator, outcome.of_hearts)
    return (1 if wrong else 3), min(outcome.covered.values(), default=1.0)


@dataclass(frozen=True)
class Criterion:
    """One thing that is asked, and what came out.

    Attributes:
        reached: Whether it is so.
        asked: What is asked, a clause.
        found: What came out, a clause.
    """

    reached: bool
    asked: str
    found: str

    @property
    def sentences(self) -> str:
        """Whether it is reached, what is asked, what came out."""
        return f"{'Reached' if self.reached else 'Not reached'}: {self.asked}. {self.found}."


def in_brief(table: pd.DataFrame, former_width: float | None = None) -> tuple[str, ...]:
    """Return in sentences what is asked and not reached, which generators are not tested, what is reached.

    Args:
        table: Rows of ``validation.csv``.
        former_width: Width of k_SR on (a) in the second sitting; None: it is not compared.
    """
    found = outcomes(table)
    asked = criteria(found, former_width)
    untested = [outcome for outcome in found if not (outcome.tested or outcome.pooled)]
    return (
        *(one.sentences for one in asked if not one.reached),
        *(f"{sentence}." for sentence in _untested(untested)),
        *(one.sentences for one in asked if one.reached),
    )


def criteria(found: Sequence[Outcome], former_width: float | None = None) -> tuple[Criterion, ...]:
    """Return all that is asked, of what there is, and what came out.

    Args:
        found: What came out for each generator.
        former_width: Width of k_SR on (a) in the second sitting; None: it is not compared.
    """
    by_name = {outcome.generator: outcome for outcome in found}
    by_letter = {outcome.letter: outcome for outcome in found if not outcome.pooled}
    each = [by_letter[letter] for letter in EACH if letter in by_letter and by_letter[letter].covered]
    made = [*_of_each(each)]
    if (together := by_name.get(POOLED_TOGETHER)) is not None and together.covered:
        made += _of_all(together)
    if STRANGER in by_letter:
        made.append(_of_strangers(by_letter[STRANGER]))
    if former_width is not None and "a" in by_letter and K_SR in by_letter["a"].rows:
        made.append(_of_width(by_letter["a"], former_width))
    return tuple(made)


def _of_each(each: Sequence[Outcome]) -> Iterator[Criterion]:
    if not each:
        return
    level = as_percent(CONFIDENCE)
    short = [outcome for outcome in each if outcome.short]
    lowest = min(each, key=lambda outcome: min(outcome.covered.values()))
    yield Criterion(
        not short,
        f"in each of {lettered([outcome.letter for outcome in each])} the coverage of shown stiffness and of "
        f"k_SR reaches {share(REACHED, 0)} with its {level} interval",
        f"Short of it: {_listed(short, _short)}" if short else f"Lowest: {_listed([lowest], _lowest)}",
    )
    often = [outcome for outcome in each if missed_too_often(outcome.generator, outcome.of_hearts)]
    most = max(each, key=lambda outcome: outcome.missed)
    yield Criterion(
        not often,
        f"in none of these are more missed than by chance, {share(BY_CHANCE, 0)}, by the {level} interval",
        f"Above it: {_listed(often, _missed)}" if often else f"Most: {_listed([most], _missed)}",
    )


def _of_all(together: Outcome) -> Iterator[Criterion]:
    over = f"over {lettered(TOGETHER)} together"
    yield Criterion(
        not together.short,
        f"{over} shown stiffness and k_SR are each covered in at least {share(LEAST_TOGETHER, 0)}",
        f"Found: {_shares(together.covered)}",
    )
    yield Criterion(
        not missed_too_often(together.generator, together.of_hearts),
        f"{over} at most {share(MOST_MISSED, 0)} are missed, {share(BY_CHANCE, 0)} being missed by chance",
        f"Found: {share(together.missed)}",
    )


def _of_strangers(outcome: Outcome) -> Criterion:
    asked = f"of {outcome.label} at most {share(MOST_STRANGERS, 0)} are not contradicted"
    return Criterion(
        outcome.not_contradicted <= MOST_STRANGERS, asked, f"Found: {share(outcome.not_contradicted)}"
    )


def _of_width(outcome: Outcome, former: float) -> Criterion:
    times = float(outcome.rows[K_SR]["width_log"]) / former
    asked = f"k_SR of (a) is at most {fixed(WIDEST, 2)} times as wide as in the second sitting"
    return Criterion(times <= WIDEST, asked, f"Found: {fixed(times, 2)} times")


def _untested(found: Sequence[Outcome]) -> Iterator[str]:
    if found:
        yield f"Not tested, since too few hearts are not contradicted: {_listed(found, _counted)}"


def _listed(found: Sequence[Outcome], said: Callable[[Outcome], str]) -> str:
    return "; ".join(f"{outcome.label}, {said(outcome)}" for outcome in found)


def _short(outcome: Outcome) -> str:
    return ", ".join(_with_interval(outcome, name) for name in outcome.short)


def _lowest(outcome: Outcome) -> str:
    return _with_interval(outcome, min(outcome.covered, key=lambda name: outcome.covered[name]))


def _with_interval(outcome: Outcome, name: str) -> str:
    return f"{NAMES[name]} {_rate(outcome.rows[name], 'coverage_not_contradicted')}"


def _missed(outcome: Outcome) -> str:
    return _rate(outcome.of_hearts, "missed_not_contradicted")


def _rate(row: Mapping[Any, Any], name: str) -> str:
    ends = (percent(float(row[f"{name}_{end}"])) for end in ("low", "high"))
    return f"{share(float(row[name]))} ({span(*ends)})"


def _counted(outcome: Outcome) -> str:
    return f"{count(outcome.of_hearts['n_not_contradicted'])} of {count(outcome.of_hearts['n'])}"


def _shares(values: Mapping[str, float]) -> str:
    """Return shares of quantities, the least first: "k_SR 71.0 %, shown stiffness 80.0 %"."""
    ordered = sorted(values.items(), key=lambda item: item[1])
    return ", ".join(f"{NAMES[name]} {share(value)}" for name, value in ordered)
