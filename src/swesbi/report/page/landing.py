"""The landing page: what was found and whether to believe it, a table, a figure, a card for each subject."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, Final

import numpy as np
import pandas as pd
from matplotlib.ticker import MaxNLocator

from swesbi.checks.identifiability import SENSITIVE
from swesbi.context import Context
from swesbi.report.columns import each_parameter, named
from swesbi.report.numbers import (
    MISSING,
    PARAMETER_UNITS,
    PARAMETERS,
    count,
    fixed,
    percent,
    quantity,
    share,
    significant,
    span,
)
from swesbi.report.page.sections import counted, coverages, too_narrow, truth_inside
from swesbi.report.paper.comparison import score_in_words
from swesbi.report.results import Experiment, Results, columns_of, records, wide
from swesbi.report.table import Table
from swesbi.report.tables.subjects import beside_the_measured, derived_of, parameters_of
from swesbi.verdict.summary import LIMITS, label_of_test
from swesbi.verdict.verdict import PAPER_STATUSES, STATUSES, Status

EJECTION: Final = "ejection_fraction"
SHOWN_LIMITS: Final = 2
WIDTH: Final = 340.0
"""Of a panel of intervals, in its own units: about the pixels of a phone."""
LEFT: Final = 30.0
RIGHT: Final = 12.0
TOP: Final = 8.0
ROW: Final = 22.0
AXIS: Final = 26.0
NOTICED: Final = 0.05
"""Shortfall of a coverage that recordings must be able to show before its level is said to be kept."""
MEANING: Final = {
    Status.NOT_CONTRADICTED: "the model can produce this recording",
    Status.UNINFORMATIVE: "the recording leaves every quantity as the prior has it",
    Status.DOUBTFUL: "use with care: some tests contradict the model",
    Status.CONTRADICTED: "do not use: the model cannot produce this recording",
    Status.PRIOR_SUPPORTED: "the prior can produce such a recording",
    Status.NOT_PRIOR_SUPPORTED: "do not use: the prior does not produce such a recording",
}


def make_landing(results: Results, title: str, links: Sequence[str]) -> Mapping[str, object]:
    """Return what only the landing page shows, of the first experiment on speeds, or else of the main one.

    ``links`` are all files behind the page, relative to it; the path of an explorer that is not among them is
    empty.
    """
    experiment = next((each for each in results.experiments if each.exact), results.main)
    answers = answers_of(experiment)
    of_parameter = {name: dict(zip(columns_of(name), LIMITS, strict=True)) for name in PARAMETERS}
    return {
        "found": list(_found(experiment, answers, title)),
        "believed": list(_believed(experiment)),
        "answers": answers_table(experiment, answers, title),
        "panels": [
            panel(symbol, PARAMETER_UNITS[name], answers.rename(columns=of_parameter[name]))
            for name, symbol in PARAMETERS.items()
        ],
        "statuses": statuses_of(experiment),
        "cards": [
            _card(experiment, each.context, links)
            for each in results.observations
            if each.context.subject in experiment.verdicts
        ],
        "paper": paper_in_a_line(results.main, results.statements),
        "explorer": "explorer.html" if "explorer.html" in links else "",
    }


def answers_of(experiment: Experiment) -> pd.DataFrame:
    """Return a row for each subject: verdict, and of each parameter "{name}_median", "_low" and "_high".

    They are those of the exact posterior, or else of ``posterior.csv``.
    """
    stored = wide(parameters_of(experiment.posterior), ["subject"], "parameter").set_index("subject")
    columns = [column for name in PARAMETERS for column in columns_of(name)]
    answers = stored.reindex(list(experiment.verdicts), columns=columns)
    for subject, verdict in experiment.verdicts.items():
        for name in verdict.answer.keys() & PARAMETERS.keys():
            answers.loc[subject, columns_of(name)] = [float(verdict.answer[name][each]) for each in LIMITS]
    return answers.astype(float).reset_index(names="subject").assign(status=experiment.status.to_numpy())


def panel(symbol: str, unit: str, answers: pd.DataFrame) -> Mapping[str, Any]:
    """Return the figure of a parameter: an interval for each subject from zero on, none without an answer.

    The template draws it as SVG inside the page, so that its letters stay legible on a phone and its colours
    follow the reader's light or dark page, which a file of matplotlib cannot. There are a mark for each
    subject, the ticks (place, text), and the same in words. ``answers`` has the columns ``subject``,
    ``status``, ``median``, ``low`` and ``high``, in that unit.
    """
    known = answers.dropna(subset="median")
    end = known["high"].max() if len(known) else 1.0
    ticks = [float(value) for value in MaxNLocator(5).tick_values(0.0, end) if value >= 0.0]
    scale = (WIDTH - LEFT - RIGHT) / ticks[-1]
    placed = {name: (LEFT + scale * known[name]).round(1) for name in ("low", "median", "high")}
    marks = known.assign(y=TOP + ROW * (np.arange(len(known)) + 0.5), **placed)
    said = [
        f"{subject} {significant(median)} ({span(significant(low), significant(high))})"
        for subject, median, low, high in known[["subject", "median", "low", "high"]].to_numpy()
    ]
    bottom = TOP + ROW * len(known)
    return {
        "symbol": symbol,
        "unit": unit,
        "width": WIDTH,
        "height": bottom + AXIS,
        "bottom": bottom,
        "left": LEFT,
        "right": WIDTH - RIGHT,
        "marks": records(marks),
        "ticks": [(round(LEFT + scale * value, 1), f"{value:g}") for value in ticks],
        "description": f"{symbol} in {unit}: {'; '.join(said)}",
    }


def answers_table(experiment: Experiment, answers: pd.DataFrame, title: str) -> Table:
    """Return a row for each subject: verdict, parameters with intervals, and what limits them."""
    said = ["; ".join(limits(experiment, name)) or MISSING for name in answers["subject"]]
    return Table(
        f"Posterior medians and {experiment.credible_percent:g} % credible intervals ({title}).",
        experiment.marked(answers.assign(limits=said)),
        named("subject", "status", *each_parameter("answer"), "limits"),
        "Amber: use with care. Grey: do not use.",
    )


def limits(experiment: Experiment, subject: str) -> Iterator[str]:
    """Yield what limits a subject's answer: tests, its sampler, what it predicts, bounds of the prior."""
    verdict = experiment.verdicts[subject]
    if flagged := [label_of_test(test.name) for test in verdict.tests if test.flagged]:
        more = f" and {len(flagged) - SHOWN_LIMITS} more" if len(flagged) > SHOWN_LIMITS else ""
        yield f"{', '.join(flagged[:SHOWN_LIMITS])}{more}"
    elif not verdict.may_be_read:
        yield "outside the prior"
    if experiment.exact and not experiment.results[subject].converged:
        yield "sampler not converged"
    table = derived_of(experiment.posterior)
    for row in records(table[(table["subject"] == subject) & (table["parameter"] == EJECTION)]):
        if (said := beside_the_measured(row)).startswith("predicted"):
            yield f"{quantity(EJECTION)} {said}"
    if experiment.exact:
        yield from _conflicts(experiment.identifiability, subject)


def _conflicts(table: pd.DataFrame, subject: str) -> Iterator[str]:
    """Name the parameters that move where either of prior and likelihood is scaled in power."""
    for row in records(table[(table["subject"] == subject) & table["quantity"].isin(PARAMETERS)]):
        if row["sensitivity_prior"] >= SENSITIVE and row["sensitivity_likelihood"] >= SENSITIVE:
            yield f"prior and recording disagree on {PARAMETERS[row['quantity']]}"


def statuses_of(experiment: Experiment) -> tuple[str, ...]:
    """Return what an experiment may say of a subject, from good to bad."""
    return STATUSES if experiment.exact else PAPER_STATUSES


def _found(experiment: Experiment, answers: pd.DataFrame, title: str) -> Iterator[str]:
    verdicts, statuses = experiment.verdicts, statuses_of(experiment)
    said = counted(experiment.verdicts, statuses)
    yield f"Can the model produce these recordings? Of {len(verdicts)} {title}: {said}."
    good = answers[answers["status"] == statuses[0]]
    if good.empty:
        yield "No posterior can be used without care."
        return
    ranges = [
        f"{symbol} {_range(good[f'{name}_median'], partial(significant, digits=2))} {PARAMETER_UNITS[name]}"
        for name, symbol in PARAMETERS.items()
    ]
    what = "medians of active stiffness, contraction and relaxation rate"
    yield f"Among those {statuses[0]}, {what} are {', '.join(ranges)}."


def _range(values: pd.Series, shown: Callable[[float], str]) -> str:
    """Return the least and the largest value, once where they look the same."""
    return " to ".join(dict.fromkeys((shown(values.min()), shown(values.max()))))


def _believed(experiment: Experiment) -> Iterator[str]:
    table = experiment.at_level(experiment.recovery_acquisition)
    contain = f"{share(table['nominal'].iloc[0], 0)} intervals contain it in: {coverages(table, 0)}"
    yield f"On simulated recordings with known truth, {contain}. {level_kept(table)}"
    if inside := truth_inside(experiment.truth):
        yield f"These recordings were simulated: {inside} contain the truth."


def level_kept(table: pd.DataFrame) -> str:
    """Return whether coverages, a row a parameter, reach their level, where recordings are enough to tell."""
    nominal, least = float(table["nominal"].iloc[0]), float(table["ci_low"].min())
    if short := [PARAMETERS[str(name)] for name in too_narrow(table).index]:
        return f"Too narrow: {', '.join(short)}."
    if nominal - least <= NOTICED:
        return "They keep their level where the model is right."
    return (
        f"{count(table['n'].min())} recordings do not exclude that they contain it in {share(least, 0)} only."
    )


def paper_in_a_line(main: Experiment, statements: pd.DataFrame) -> str:
    """Return what came out of the experiment that repeats the paper, beside its statements."""
    table = main.at_level(main.recovery_acquisition)
    covered = _range(table["coverage"], partial(percent, decimals=0))
    inside = sum(verdict.may_be_read for verdict in main.verdicts.values())
    return (
        f"The experiment {main.name} repeats the published method: {score_in_words(statements)}. Its prior "
        f"supports {inside} of {len(main.verdicts)} subjects, and with the noise of an acquisition its "
        f"{share(table['nominal'].iloc[0], 0)} intervals contain the true value in {covered} %."
    )


def _card(experiment: Experiment, context: Context, links: Sequence[str]) -> Mapping[str, str]:
    """Return verdict, who was recorded and predictive check of a subject, and its figure."""
    subject, picture = context.subject, f"{experiment.name}/subjects/{context.subject}/ppc.png"
    status = experiment.verdicts[subject].status
    ejected = percent(1.0 - context.lvesv_ml / context.lvedv_ml, 0)
    who = f"{context.sex}, {context.age_years:g} years, {context.hr_bpm:g} /min"
    scores = experiment.scores[experiment.scores["subject"] == subject].dropna(subset="rmse_kpa")
    check = "No predictive check."
    for row in records(scores):
        inside = share(row["coverage_observed_phases"], 0)
        check = f"RMSE {fixed(row['rmse_kpa'], 1)} kPa; {inside} of the phases are inside the predicted band."
    return {
        "subject": subject,
        "status": status,
        "recording": f"{who}, ejection fraction {ejected} %",
        "verdict": MEANING[status],
        "check": check,
        "picture": picture if picture in links else "",
    }
