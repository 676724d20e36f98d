"""The experiments beside each other: what differs in their settings, and what that does."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import combinations
from typing import Any, Final

from markupsafe import Markup

from swesbi.parameters import THETA_NAMES
from swesbi.report.names import PARAMETER_UNITS, PARAMETERS
from swesbi.report.numbers import MISSING, count, estimate, fixed, mean_sd, percent
from swesbi.report.recovery import level
from swesbi.report.results import Experiment, records
from swesbi.report.table import Cell, Column, Row, Table, body, words

_KINDS: Final = {False: "noise on features", True: "noise on the measured speeds"}
PAIRS: Final = tuple(combinations(THETA_NAMES, 2))
SCORES: Final = (
    ("RMSE, prior predictive (kPa)", "rmse_prior_kpa", 1.0, 2),
    ("RMSE, posterior predictive (kPa)", "rmse_kpa", 1.0, 2),
    ("RMSE reduction (%)", "rmse_reduction_percent", 1.0, 1),
    ("R²", "r2", 1.0, 3),
    ("Post-peak RMSE (kPa)", "post_peak_rmse_kpa", 1.0, 2),
    ("Coverage of the predictive band, grid (%)", "coverage_grid", 100.0, 0),
    ("Coverage of the predictive band, measured phases (%)", "coverage_phases", 100.0, 0),
)


def differences_table(experiments: Sequence[Experiment], main: Experiment) -> Table:
    """Return the settings in which each experiment differs from the main one.

    One of another kind, which has other settings altogether, differs in its kind.
    """
    reference = dict(_leaves(main.settings))
    rows: list[tuple[Cell, ...]] = []
    for experiment in experiments:
        if experiment.exact != main.exact:
            rows.append((experiment.name, "kind", *(_KINDS[part.exact] for part in (main, experiment))))
            continue
        own = dict(_leaves(experiment.settings))
        changed = [key for key in {**reference, **own} if own.get(key) != reference.get(key)]
        rows.extend(
            (experiment.name, key, _value(reference.get(key)), _value(own.get(key))) for key in changed
        )
    columns = words("Experiment", "Setting", f"In {main.name}", "Here")
    return Table(f"What differs from the experiment {main.name}.", columns, body(rows))


def comparison_table(experiments: Sequence[Experiment], cohort_title: str) -> Table:
    """Return one column an experiment: support, scores, correlations, coverages, training."""
    lines = [(label, [value(part) for part in experiments]) for label, value in _measures()]
    columns = (
        Column("Mean ± sd over supported subjects", numeric=False),
        *(Column(e.name) for e in experiments),
    )
    note = (
        "Each experiment's means are over the subjects that its own prior supports, so they may be over "
        "different subjects."
    )
    return Table(
        f"Experiments side by side ({cohort_title}).",
        columns,
        tuple(Row((label, *values)) for label, values in lines),
        note,
    )


def median_table(experiments: Sequence[Experiment], cohort_title: str) -> Table:
    """Return each subject's posterior medians with credible intervals, one column an experiment."""
    columns = (
        *words("Subject", "Parameter", "Unit"),
        *(Column(experiment.name) for experiment in experiments),
    )
    cells = [_medians(experiment) for experiment in experiments]
    rows = [
        (subject, label, PARAMETER_UNITS[name], *(part.get((subject, name), MISSING) for part in cells))
        for subject in experiments[0].supports
        for name, label in PARAMETERS.items()
    ]
    note = "Median and credible interval; a dash where the experiment's prior does not support the subject."
    return Table(f"Posterior medians by experiment ({cohort_title}).", columns, body(rows), note)


def correlations(experiment: Experiment, one: str, other: str) -> list[float]:
    """Return the posterior correlation of two parameters in every supported subject."""
    table = experiment.posterior
    rows = table[(table["parameter"] == one) & table["supported"]]
    return [float(value) for value in rows[f"correlation_{other}"]]


def _measures() -> Iterator[tuple[str, Callable[[Experiment], str]]]:
    yield "Subjects supported", _supported
    for label, column, scale, decimals in SCORES:
        yield label, partial(_score, column=column, scale=scale, decimals=decimals)
    for one, other in PAIRS:
        label = Markup("Correlation of {} and {}").format(PARAMETERS[one], PARAMETERS[other])
        yield label, partial(_correlation, one=one, other=other)
    for name, symbol in PARAMETERS.items():
        yield Markup("Recovery coverage of {} (%)").format(symbol), partial(_coverage, parameter=name)
    yield "Epochs trained", lambda experiment: count(len(experiment.training))
    yield "Lowest validation loss", lambda experiment: fixed(experiment.training["validation_loss"].min(), 2)


def _score(experiment: Experiment, *, column: str, scale: float, decimals: int) -> str:
    return mean_sd(scale * experiment.supported[column].to_numpy(), decimals)


def _correlation(experiment: Experiment, *, one: str, other: str) -> str:
    return mean_sd(correlations(experiment, one, other), 2)


def _coverage(experiment: Experiment, *, parameter: str) -> str:
    return percent(level(experiment.recovery.own, experiment).get(parameter, math.nan))


def _supported(experiment: Experiment) -> str:
    names = [subject for subject, support in experiment.supports.items() if support.supported]
    return f"{len(names)} of {len(experiment.supports)}" + (f" ({', '.join(names)})" if names else "")


def _medians(experiment: Experiment) -> dict[tuple[str, str], str]:
    table = experiment.posterior
    rows = records(table[table["parameter"].isin(PARAMETERS) & table["supported"]])
    return {
        (str(row["subject"]), str(row["parameter"])): "{} ({})".format(
            *estimate(row["median"], row["ci_low"], row["ci_high"])
        )
        for row in rows
    }


def _leaves(plain: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Yield every setting by its dotted key."""
    for key, value in plain.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _value(value: object) -> str:
    if value is None:
        return MISSING
    return f"{value:g}" if isinstance(value, float) else json.dumps(value, ensure_ascii=False).strip('"')
