"""The landing page: what was found and whether to believe it, a table, a figure, a card for each subject."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import pandas as pd

from swesbi.recording.observation import Observation
from swesbi.report.numbers import (
    MISSING,
    PARAMETER_UNITS,
    PARAMETERS,
    estimate,
    fixed,
    percent,
    quantity,
    share,
    significant,
)
from swesbi.report.page.forest import Interval, Panel, panel
from swesbi.report.results import Experiment, Results, is_true, records
from swesbi.report.table import Column, Row, Table, words
from swesbi.report.tables.exact import Exact
from swesbi.report.tables.experiments import level, nearest_level
from swesbi.report.tables.subjects import beside_the_measured
from swesbi.verdict.answers import label_of_test
from swesbi.verdict.verdict import (
    CONTRADICTED,
    NOT_CONTRADICTED,
    NOT_PRIOR_SUPPORTED,
    PAPER_STATUSES,
    PRIOR_SUPPORTED,
    STATUSES,
    STRAINED,
    Verdict,
)

EJECTION: Final = "ejection_fraction"
SHOWN_LIMITS: Final = 2
MEANING: Final = {
    NOT_CONTRADICTED: "the model can have made this recording",
    STRAINED: "read with care: some tests speak against the model",
    CONTRADICTED: "not to be read: the model cannot have made this recording",
    PRIOR_SUPPORTED: "the prior can make such a recording",
    NOT_PRIOR_SUPPORTED: "not to be read: the prior does not make such a recording",
}


@dataclass(frozen=True)
class Card:
    """What the page says of one subject.

    Attributes:
        subject: Its name.
        status: Its verdict in a word.
        recording: Who was recorded, in a line.
        verdict: The verdict in words.
        medians: The parameters in a line.
        check: The predictive check in a line.
        picture: Its figure, relative to the page; empty where there is none.
    """

    subject: str
    status: str
    recording: str
    verdict: str
    medians: str
    check: str
    picture: str


@dataclass(frozen=True)
class Landing:
    """What only the landing page shows.

    Attributes:
        experiment: The experiment whose answers it gives.
        found: What was found, in sentences.
        believed: Whether to believe it, in sentences.
        answers: A row for each subject.
        panels: The figure, a panel for each parameter.
        statuses: What the experiment may say of a subject, from good to bad.
        cards: One for each subject.
        paper: The paper's experiment in a line.
        explorer: The explorer, relative to the page; empty where there is none.
    """

    experiment: str
    found: tuple[str, ...]
    believed: tuple[str, ...]
    answers: Table
    panels: tuple[Panel, ...]
    statuses: tuple[str, ...]
    cards: tuple[Card, ...]
    paper: str
    explorer: str


def make_landing(results: Results, exact: Sequence[Exact], title: str, links: Sequence[str]) -> Landing:
    """Put the landing page together: of the first experiment on speeds, or else of the main experiment.

    Args:
        results: The study.
        exact: Its experiments on speeds.
        title: What the subjects are.
        links: Every file behind the page, relative to it.
    """
    speeds = next(iter(exact), None)
    experiment = speeds.experiment if speeds else results.main
    pictures = {name: f"{experiment.name}/subjects/{name}/ppc.png" for name in experiment.verdicts}
    observed = {each.context.subject: each for each in results.observations}
    return Landing(
        experiment=experiment.name,
        found=tuple(_found(experiment, title)),
        believed=tuple(_believed(experiment, speeds)),
        answers=answers_table(experiment, speeds, title),
        panels=tuple(
            panel(symbol, PARAMETER_UNITS[name], _intervals(experiment, name))
            for name, symbol in PARAMETERS.items()
        ),
        statuses=statuses_of(experiment),
        cards=tuple(
            _card(experiment, observed[name], verdict, pictures[name] if pictures[name] in links else "")
            for name, verdict in experiment.verdicts.items()
        ),
        paper=paper_in_a_line(results.main),
        explorer=next((link for link in links if link == "explorer.html"), ""),
    )


def answer_of(experiment: Experiment, subject: str, name: str) -> tuple[float, float, float]:
    """Return median and limits: of the exact posterior, or of ``posterior.csv``; NaN where unanswered."""
    if said := experiment.verdicts[subject].answer.get(name):
        return float(said["median"]), float(said["low"]), float(said["high"])
    row = _rows(experiment, subject).get(name)
    if row is None:
        return math.nan, math.nan, math.nan
    return float(row["median"]), float(row["ci_low"]), float(row["ci_high"])


def answers_table(experiment: Experiment, exact: Exact | None, title: str) -> Table:
    """Return a row for each subject: verdict, parameters with intervals, and what limits them."""
    columns = (
        *words("Subject", "Verdict"),
        *(Column(symbol, PARAMETER_UNITS[name]) for name, symbol in PARAMETERS.items()),
        *words("What limits them"),
    )
    rows = []
    for subject, verdict in experiment.verdicts.items():
        values = [_shown(*answer_of(experiment, subject, name)) for name in PARAMETERS]
        cells = (subject, verdict.status, *values, "; ".join(limits(experiment, exact, subject)) or MISSING)
        rows.append(Row(cells, muted=not verdict.may_be_read, strained=verdict.status == STRAINED))
    mass = f"{experiment.credible_percent:g} %"
    return Table(
        f"Posterior medians and {mass} credible intervals ({title}).",
        columns,
        tuple(rows),
        "Amber: read with care. Grey: not to be read as the subject's.",
    )


def limits(experiment: Experiment, exact: Exact | None, subject: str) -> Iterator[str]:
    """Yield what limits a subject's answer: tests, its sampler, what it predicts, bounds of the prior."""
    verdict = experiment.verdicts[subject]
    if flagged := [label_of_test(test.name) for test in verdict.tests if test.flagged]:
        more = f" and {len(flagged) - SHOWN_LIMITS} more" if len(flagged) > SHOWN_LIMITS else ""
        yield f"{', '.join(flagged[:SHOWN_LIMITS])}{more}"
    elif not verdict.may_be_read:
        yield "outside the prior"
    if exact and not exact.results[subject].converged:
        yield "sampler not converged"
    predicted = _rows(experiment, subject).get(EJECTION)
    said = beside_the_measured(predicted) if predicted is not None else ""
    if said.startswith("predicted"):
        yield f"{quantity(EJECTION)} {said}"
    for name in _open(exact, subject):
        yield f"{PARAMETERS[name]} bounded by the prior alone"


def _open(exact: Exact | None, subject: str) -> list[str]:
    """Return the parameters that the recording alone does not bound on both sides."""
    if exact is None:
        return []
    table = exact.identifiability
    rows = records(table[(table["subject"] == subject) & table["quantity"].isin(PARAMETERS)])
    ends = ("likelihood_low_open", "likelihood_high_open")
    return [str(row["quantity"]) for row in rows if any(is_true(row[end]) for end in ends)]


def _rows(experiment: Experiment, subject: str) -> Mapping[str, Mapping[Any, Any]]:
    table = experiment.posterior
    return {str(row["parameter"]): row for row in records(table[table["subject"] == subject])}


def _shown(median: float, low: float, high: float) -> str:
    shown, interval = estimate(median, low, high)
    return MISSING if shown == MISSING else f"{shown} ({interval})"


def _intervals(experiment: Experiment, name: str) -> list[Interval]:
    return [
        Interval(subject, verdict.status, *answer_of(experiment, subject, name))
        for subject, verdict in experiment.verdicts.items()
    ]


def statuses_of(experiment: Experiment) -> tuple[str, ...]:
    """Return what an experiment may say of a subject, from good to bad."""
    return STATUSES if experiment.exact else PAPER_STATUSES


def _found(experiment: Experiment, title: str) -> Iterator[str]:
    verdicts, statuses = experiment.verdicts, statuses_of(experiment)
    by_status = {
        word: [name for name, verdict in verdicts.items() if verdict.status == word] for word in statuses
    }
    counted = ", ".join(
        f"{len(names)} {word} ({', '.join(names)})" for word, names in by_status.items() if names
    )
    yield f"Could the model have made these recordings? Of {len(verdicts)} {title}: {counted}."
    names = by_status[statuses[0]]
    if not names:
        yield "No answer may be read as a subject's without care."
        return
    ranges = []
    for parameter, symbol in PARAMETERS.items():
        medians = [answer_of(experiment, name, parameter)[0] for name in names]
        span = " to ".join(dict.fromkeys(significant(value, 2) for value in (min(medians), max(medians))))
        ranges.append(f"{symbol} {span} {PARAMETER_UNITS[parameter]}")
    what = "medians of active stiffness, contraction and relaxation rate"
    yield f"Among those {statuses[0]}, {what} are {', '.join(ranges)}."


def _believed(experiment: Experiment, exact: Exact | None) -> Iterator[str]:
    table = experiment.recovery.acquisition
    nominal, covered = nearest_level(table, experiment), level(table, experiment)
    rows = records(table[table["nominal"] == nominal])
    short = [PARAMETERS[str(row["parameter"])] for row in rows if row["ci_high"] < nominal]
    shares = ", ".join(f"{symbol} {share(covered[name], 0)}" for name, symbol in PARAMETERS.items())
    judged = (
        f"Too narrow: {', '.join(short)}." if short else "They mean what they say where the model is right."
    )
    intervals = f"{share(nominal, 0)} intervals"
    yield f"On simulated recordings with known truth, {intervals} hold it in: {shares}. {judged}"
    known = exact.truth.dropna(subset="median") if exact is not None and len(exact.truth) else pd.DataFrame()
    if len(known):
        inside = int(known["inside"].map(is_true).sum())
        yield f"These recordings were generated: the truth lies in {inside} of {len(known)} intervals."


def paper_in_a_line(main: Experiment) -> str:
    """Return what came out of the experiment that repeats the paper."""
    table = main.recovery.acquisition
    nominal, covered = nearest_level(table, main), level(table, main)
    values = [covered[name] for name in PARAMETERS]
    span = " to ".join(dict.fromkeys((percent(min(values), 0), percent(max(values), 0))))
    inside = sum(verdict.may_be_read for verdict in main.verdicts.values())
    return (
        f"The experiment {main.name} repeats the published method: its prior supports {inside} of "
        f"{len(main.verdicts)} subjects, and with the noise of an acquisition its "
        f"{share(nominal, 0)} intervals contain the true value in {span} %."
    )


def _card(experiment: Experiment, observation: Observation, verdict: Verdict, picture: str) -> Card:
    context, subject = observation.context, observation.context.subject
    ejected = percent(1.0 - context.lvesv_ml / context.lvedv_ml, 0)
    medians = "; ".join(
        f"{symbol} {_shown(*answer_of(experiment, subject, name))} {PARAMETER_UNITS[name]}"
        for name, symbol in PARAMETERS.items()
    )
    scores = experiment.scores
    row = next(iter(records(scores[scores["subject"] == subject])), {})
    check = "No predictive check."
    if row and not math.isnan(row["rmse_kpa"]):
        inside = share(row["coverage_observed_phases"], 0)
        check = f"RMSE {fixed(row['rmse_kpa'], 1)} kPa; {inside} of the phases inside the predicted band."
    who = f"{context.sex}, {context.age_years:g} years, {context.hr_bpm:g} /min"
    return Card(
        subject=subject,
        status=verdict.status,
        recording=f"{who}, ejection fraction {ejected} %",
        verdict=MEANING[verdict.status],
        medians=medians,
        check=check,
        picture=picture,
    )
