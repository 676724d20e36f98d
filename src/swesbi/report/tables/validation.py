"""The validation of the shipped study by hearts of other generators: its stored table, and what it reached.

The stored table has all rounds: the columns of ``validation.csv`` behind those that say which round a row
is of. Shown, pooled rows stand first. Generators that miss what is asked follow, then those that are not
tested, then the others. matplotlib is not imported.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Annotated, Final, NamedTuple

import numpy as np
import pandas as pd

from swesbi.artefacts import UnfitError
from swesbi.artefacts.csv import Table as Format
from swesbi.parameters import HALF_ACTIVE, ISOMETRIC, PEAK_ACTIVE
from swesbi.report.columns import COLUMNS as COLUMNS_SHOWN
from swesbi.report.numbers import as_percent, count, fixed, percent, quantity, share, span
from swesbi.report.table import MARK, MUTED, Cell, Column, Strong, Table, words

K_SR: Final = "k_sr_per_s"
QUANTITIES: Final = (
    PEAK_ACTIVE.name,
    K_SR,
    "duration_ms",
    "peak_kpa",
    "decay_rate_per_s",
    HALF_ACTIVE.name,
    "late_diastole_kpa",
    ISOMETRIC,
    "k0_kpa",
    "k_atp_per_s",
)
"""What is scored, a row each of a generator that has it."""
SCORED: Final = 2
"""The first of them, peak active stiffness and k_SR, make a heart missed."""
OF_EVERY_GENERATOR: Final = QUANTITIES[:SCORED]
"""Quantities of which a coverage is asked: peak active stiffness and k_SR."""
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
FILLS_OTHERWISE: Final = "e"
"""The generator whose hearts fill as the model's did not before version 4."""
LEAST_RATE: Final = 0.78
"""Least coverage of k_SR over all its answered hearts; its interval must reach ``REACHED`` too."""
LEAST_ACCEPTED: Final = 0.65
"""Least share of its hearts that are not contradicted."""
MOST_MISSED_OF_IT: Final = 0.31
"""Largest share missed of these."""
WIDEST: Final = 1.35
"""Largest width of k_SR on (a), in widths of the second round."""

POOLED: Final = "pooled"
POOLED_TOGETHER: Final = f"{POOLED}: {', '.join(TOGETHER)}"
POOLED_ALL: Final = f"{POOLED}: all"
"""What the table calls the hearts of several generators together."""
ALL_TOGETHER: Final = "all together"
COVERED: Final = "coverage_not_contradicted"
MISSED: Final = "missed_not_contradicted"
Outcome = tuple[bool, str, str]
"""Whether something is reached, what is asked, and what came out; clauses."""

VERDICTS: Final = ("not_contradicted", "doubtful", "contradicted")
OF_THOSE: Final = "% of the not contradicted (interval)"
RATES: Final = {name: (name, f"{name}_low", f"{name}_high") for name in ("coverage", COVERED, MISSED)}
COLUMNS: Final = (
    "generator", "quantity", "n", *VERDICTS,
    *(column for columns in RATES.values() for column in columns),
    "bias_log", "width_log", "n_not_contradicted", "tested",
)  # fmt: skip
OF_ROUND: Final = ("round", "date", "model")
"""Its number, the day on which it ended, and what was changed of the model before it."""
VALIDATION: Final = Format(columns=COLUMNS, row="generator")
"""``validation.csv``: one row a generator and quantity."""
ROUNDS: Final = Format(columns=(*OF_ROUND, *COLUMNS), row="round")
RoundsTable = Annotated[pd.DataFrame, ROUNDS]
"""The stored table of all rounds."""
COMPARED: Final = 2
"""The round whose width of k_SR on (a) later ones are compared with."""
NOTE: Final = (
    "Pooled generators come first, then those that miss what is asked. Verdicts: of all hearts, those "
    f"refused making up the rest. Intervals: {percent(CONFIDENCE, 0)} % Clopper-Pearson. "
    "Bias (mean of log median / truth) and "
    "width (median of log high / low): of the answered. Missed: peak active stiffness or k_SR outside its "
    f"interval; two independent calibrated intervals miss {percent(BY_CHANCE, 0)} % by chance. "
    f"Bold: a coverage whose interval does not reach {percent(REACHED, 0)} %, or more missed than by chance "
    f"({percent(BY_CHANCE, 0)} %, or {percent(MOST_MISSED, 0)} % of several generators together)."
)


class StoredValidation(NamedTuple):
    """What the page shows of the validation: what came out in sentences, and all of it."""

    brief: tuple[str, ...]
    table: Table


def letters(rows: pd.DataFrame) -> frozenset[str]:
    """Return the letters of the generators that were asked."""
    return frozenset(rows["generator"].str.partition(":")[0]) - {POOLED}


def shown_validation(table: pd.DataFrame) -> StoredValidation:
    """Return what the page shows: the last round that asked every generator that any round asked."""
    whole = [rows for _, rows in table.groupby("round") if letters(rows) == letters(table)]
    if not whole:
        asked = ", ".join(sorted(letters(table)))
        raise UnfitError("validation", f"no round of the validation asked all generators, {asked}")
    shown = whole[-1]
    number, date, model = shown.iloc[0][list(OF_ROUND)]
    return StoredValidation(
        in_brief(shown, compared_width(table, number)),
        validation_table(shown, f"The validation of the shipped study: round {number}, {date}; {model}."),
    )


def compared_width(rounds: pd.DataFrame, number: int) -> float | None:
    """Return the width of k_SR on (a) that a round is compared with; None for one that is not later."""
    of_a = rounds["generator"].str.startswith("a:") & (rounds["quantity"] == K_SR)
    widths = rounds.loc[of_a & (rounds["round"] == COMPARED), "width_log"]
    return float(widths.iloc[0]) if len(widths) and number > COMPARED else None


def validation_table(table: pd.DataFrame, caption: str) -> Table:
    """Return a row a generator and quantity: verdicts, coverage, what is missed, bias and width."""
    columns = (
        words("label", "Hearts"),
        COLUMNS_SHOWN["quantity"],
        Column("n", "Number", "", "d"),
        *(Column(each, each.replace("_", " ").capitalize(), "%", "0%") for each in VERDICTS),
        Column(RATES["coverage"], "Coverage", "% of all answered (interval)", _rate),
        Column((*RATES[COVERED], "is_tested", "short"), "Coverage", OF_THOSE, _judged),
        Column(
            (*RATES[MISSED], "is_tested", "often", "first"),
            "Missed",
            f"{OF_THOSE}; {percent(BY_CHANCE, 0)} by chance",
            _judged,
        ),
        Column("bias_log", "Bias", "log", "2f"),
        Column("width_log", "Width", "log", "2f"),
    )
    rows = judged(table)
    return Table(
        caption, rows.assign(**{MARK: rows["is_tested"].map({True: "", False: MUTED})}), columns, NOTE
    )


def _rate(value: float, low: float, high: float) -> str:
    shown = percent(value)
    return shown if pd.isna(value) else f"{shown} ({span(percent(low, 0), percent(high, 0))})"


def _judged(value: float, low: float, high: float, tested: bool, wrong: bool, first: bool = True) -> Cell:
    """Return a rate, bold where it is not as asked; what is missed is of hearts: of the first row alone."""
    if not first:
        return ""
    shown = _rate(value, low, high) if tested else NOT_TESTED
    return Strong(shown) if wrong else shown


def named(letters: Iterable[str], generators: Iterable[str]) -> str:
    """Return what the generators of letters are called, among "a: generator of the study" and others."""
    titles = dict(generator.split(": ", 1) for generator in generators)
    return "; ".join(titles.get(letter, f"({letter})") for letter in letters)


def judged(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of ``validation.csv`` in the order above, with what is said of each.

    The further columns are ``letter`` ("a" or "pooled") and ``label`` ("generator of the study"). The
    generator's ``first`` row says what is true of all its hearts. A coverage is ``asked`` of a row that
    ``is_tested``, and ``short`` where it covers less. A first row is ``often`` where more hearts are missed
    than is asked.
    """
    places = table["quantity"].map({name: place for place, name in enumerate(QUANTITIES)})
    rows = table.assign(place=places).dropna(subset="place").sort_values(["generator", "place"])
    generator = rows["generator"]
    letter = generator.str.partition(":")[0]
    first, tested = ~generator.duplicated(), rows["tested"] == TESTED
    together, each = generator == POOLED_TOGETHER, letter.isin(EACH)
    short = (together & (rows[COVERED] < LEAST_TOGETHER)) | (each & (rows[f"{COVERED}_high"] < REACHED))
    often = (together & (rows[MISSED] > MOST_MISSED)) | (each & (rows[f"{MISSED}_low"] > BY_CHANCE))
    asked = tested & rows["quantity"].isin(OF_EVERY_GENERATOR)
    rows = rows.assign(
        letter=letter,
        label=[_label(name, generator) for name in generator],
        first=first,
        is_tested=tested,
        asked=asked,
        short=asked & short,
        often=first & tested & often,
    )
    order = {name: _order(own) for name, own in rows.groupby("generator")}
    return rows.sort_values("generator", key=lambda names: names.map(order), kind="stable")


def _label(generator: str, generators: Iterable[str]) -> str:
    if generator == POOLED_ALL:
        return ALL_TOGETHER
    letter, _, title = generator.partition(": ")
    return f"{named(title.split(', '), generators)} together" if letter == POOLED else title


def _order(rows: pd.DataFrame) -> tuple[int, float]:
    """Return the place: pooled, missed, not tested, the rest; the least share first among them."""
    first = rows.iloc[0]
    if first["letter"] == POOLED:
        return 0, float(first["label"] == ALL_TOGETHER)
    if not first["is_tested"]:
        return 2, float(first["not_contradicted"])
    least = rows.loc[rows["asked"], COVERED].min()
    wrong = bool((rows["short"] | rows["often"]).any())
    return (1 if wrong else 3), 1.0 if np.isnan(least) else float(least)


def in_brief(table: pd.DataFrame, former_width: float | None = None) -> tuple[str, ...]:
    """Return in sentences what is asked and not reached, which generators are not tested, what is reached.

    The width of k_SR on (a) is compared with that of the second round, unless there is none.
    """
    rows = judged(table)
    found = [
        *_of_each(rows),
        *_of_all(rows),
        *_of_filling(rows),
        *_of_strangers(rows),
        *_of_width(rows, former_width),
    ]
    untested = rows[rows["first"] & ~rows["is_tested"] & (rows["letter"] != POOLED)]
    counts = [
        f"{label}, {count(good)} of {count(n)}"
        for label, good, n in zip(
            untested["label"], untested["n_not_contradicted"], untested["n"], strict=True
        )
    ]
    return (
        *(f"Not reached: {asked}. {what}." for reached, asked, what in found if not reached),
        *([f"Not tested, since too few hearts are not contradicted: {'; '.join(counts)}."] if counts else ()),
        *(f"Reached: {asked}. {what}." for reached, asked, what in found if reached),
    )


def _of_each(rows: pd.DataFrame) -> Iterator[Outcome]:
    covered = rows[rows["asked"] & rows["letter"].isin(EACH)].sort_values("letter", kind="stable")
    if covered.empty:
        return
    level, short = as_percent(CONFIDENCE), covered[covered["short"]]
    each = named(covered["letter"].unique(), rows["generator"])
    yield (
        short.empty,
        f"for each of {each}, the coverage of peak active stiffness and of k_SR reaches {share(REACHED, 0)} "
        f"with its {level} interval",
        f"Lowest: {_rates(covered.loc[[covered[COVERED].idxmin()]], COVERED)}"
        if short.empty
        else f"Short of it: {_rates(short, COVERED)}",
    )
    heads = rows[rows["first"] & rows["generator"].isin(covered["generator"])]
    heads = heads.sort_values("letter", kind="stable")
    often = heads[heads["often"]]
    yield (
        often.empty,
        f"in none of these are more missed than by chance, {share(BY_CHANCE, 0)}, by the {level} interval",
        f"Most: {_rates(heads.loc[[heads[MISSED].idxmax()]], MISSED)}"
        if often.empty
        else f"Above it: {_rates(often, MISSED)}",
    )


def _of_all(rows: pd.DataFrame) -> Iterator[Outcome]:
    own = rows[rows["generator"] == POOLED_TOGETHER]
    covered = own[own["asked"]].sort_values(COVERED, kind="stable")
    if covered.empty:
        return
    over = f"over {named(TOGETHER, rows['generator'])} together"
    found = [
        f"{quantity(name)} {share(value)}, {share(of_all)} of all answered"
        for name, value, of_all in covered[["quantity", COVERED, "coverage"]].to_numpy()
    ]
    yield (
        not covered["short"].any(),
        f"{over} peak active stiffness and k_SR are each covered in at least {share(LEAST_TOGETHER, 0)}",
        f"Found: {'; '.join(found)}",
    )
    yield (
        not own["often"].any(),
        f"{over} at most {share(MOST_MISSED, 0)} are missed, {share(BY_CHANCE, 0)} being missed by chance",
        f"Found: {share(float(own[MISSED].iloc[0]))}",
    )
    for _, row in own[own["quantity"] == PEAK_ACTIVE.name].iterrows():
        yield (
            float(row["coverage_high"]) >= REACHED,
            f"{over}, whatever the verdict, the coverage of peak active stiffness reaches "
            f"{share(REACHED, 0)} with its {as_percent(CONFIDENCE)} interval",
            f"Found: {_of_answered(row)}",
        )


def _of_filling(rows: pd.DataFrame) -> Iterator[Outcome]:
    for _, row in rows[(rows["letter"] == FILLS_OTHERWISE) & (rows["quantity"] == K_SR)].iterrows():
        level, accepted, missed = as_percent(CONFIDENCE), float(row["not_contradicted"]), float(row[MISSED])
        yield (
            float(row["coverage"]) >= LEAST_RATE and float(row["coverage_high"]) >= REACHED,
            f"of {row['label']}, whatever the verdict, at least {share(LEAST_RATE, 0)} have k_SR in its "
            f"interval, and the {level} interval of this share reaches {share(REACHED, 0)}",
            f"Found: {_of_answered(row)}",
        )
        asked = f"of {row['label']} at least {share(LEAST_ACCEPTED, 0)} are not contradicted"
        yield accepted >= LEAST_ACCEPTED, asked, f"Found: {share(accepted)}"
        asked = f"of {row['label']}, where not contradicted, at most {share(MOST_MISSED_OF_IT, 0)} are missed"
        yield missed <= MOST_MISSED_OF_IT, asked, f"Found: {share(missed)}"


def _of_answered(row: pd.Series) -> str:
    """Return the coverage of all answered hearts with its interval."""
    low, high = percent(row["coverage_low"]), percent(row["coverage_high"])
    return f"{share(row['coverage'])} ({span(low, high)})"


def _of_strangers(rows: pd.DataFrame) -> Iterator[Outcome]:
    for _, row in rows[rows["first"] & (rows["letter"] == STRANGER)].iterrows():
        asked = f"of {row['label']} at most {share(MOST_STRANGERS, 0)} are not contradicted"
        good = float(row["not_contradicted"])
        yield good <= MOST_STRANGERS, asked, f"Found: {share(good)}"


def _of_width(rows: pd.DataFrame, former: float | None) -> Iterator[Outcome]:
    widths = rows.loc[(rows["letter"] == "a") & (rows["quantity"] == K_SR), "width_log"]
    if former is None or widths.empty:
        return
    times = float(widths.iloc[0]) / former
    own = named("a", rows["generator"])
    asked = f"k_SR of the {own} is at most {fixed(WIDEST, 2)} times as wide as in the second round"
    yield times <= WIDEST, asked, f"Found: {fixed(times, 2)} times"


def _rates(rows: pd.DataFrame, rate: str) -> str:
    """Return a rate of rows with its interval, generator by generator; a coverage with its quantity."""
    said = []
    for label, part in rows.groupby("label", sort=False):
        values = [
            f"{quantity(name)} " * (rate == COVERED) + f"{share(value)} ({span(percent(low), percent(high))})"
            for name, value, low, high in part[["quantity", rate, f"{rate}_low", f"{rate}_high"]].to_numpy()
        ]
        said.append(f"{label}, {', '.join(values)}")
    return "; ".join(said)
