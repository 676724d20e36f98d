"""Tables of the experiments beside each other: recovery, settings, scores, training, the paper's numbers."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import Any, Final

import pandas as pd

from swesbi.parameters import THETA_NAMES
from swesbi.report import numbers
from swesbi.report.csv import checked
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
    ("Coverage by the band of noiseless curves, grid (%)", "coverage_noiseless_grid", 100.0, 0),
    ("Coverage by the band of noiseless curves, phases (%)", "coverage_noiseless_phases", 100.0, 0),
    ("Coverage by the interval of new observations, grid (%)", "coverage_observed_grid", 100.0, 0),
    (
        "Coverage by the interval of new observations, phases (%)",
        "coverage_observed_phases",
        100.0,
        0,
    ),
    ("Ceiling: coverage by the prior's noiseless band, grid (%)", "coverage_prior_band_grid", 100.0, 0),
    (
        "Ceiling: coverage by the prior's envelope, grid (%)",
        "coverage_prior_envelope_grid",
        100.0,
        0,
    ),
)
COLUMNS: Final = ("quantity", "paper", "this_study", "note", "origin")
DESIGNED: Final = "designed"
MARK: Final = "†"


def level(table: pd.DataFrame, experiment: Experiment) -> dict[str, float]:
    """Return the coverage of each parameter at the nominal level of the experiment's credible intervals.

    Where the study has not scored that level, the one next to it is taken; the tables name it.
    """
    rows = table[table["nominal"] == nearest_level(table, experiment)]
    return {str(row["parameter"]): float(row["coverage"]) for row in records(rows)}


def nearest_level(table: pd.DataFrame, experiment: Experiment) -> float:
    """Return the nominal level next to that of the experiment's credible intervals."""
    wanted = experiment.credible_percent / 100.0
    return min((float(value) for value in table["nominal"].unique()), key=lambda value: abs(value - wanted))


def recovery_table(experiments: Sequence[Experiment]) -> Table:
    """Return both recoveries side by side, at the level of the credible intervals."""
    rows = [
        row
        for experiment in experiments
        for row in _rows(experiment, nearest_level(experiment.recovery.own, experiment))
    ]
    return _table("Recovery of known parameters.", rows)


def levels_table(experiment: Experiment) -> Table:
    """Return both recoveries of one experiment at every nominal level."""
    levels = experiment.recovery.own["nominal"].unique()
    rows = [row for nominal in levels for row in _rows(experiment, float(nominal))]
    return _table(f"Recovery at every nominal level, experiment {experiment.name}.", rows)


def _table(caption: str, rows: Sequence[Row]) -> Table:
    columns = (
        *words("Experiment", "Parameter"),
        Column("Nominal", "%"),
        Column("Coverage, own noise", "% (interval)"),
        Column("Recordings"),
        Column("Coverage, acquisition noise", "% (interval)"),
        Column("Recordings"),
        Column("Bias", "own noise"),
        Column("Bias", "acquisition"),
        Column("Contraction", "own noise"),
    )
    note = (
        "Own noise: the experiment's observation model on the features. Acquisition noise: synthetic "
        "recordings, passed through quality control, passive calibration and inference like a measured one. "
        "Intervals are Clopper-Pearson intervals on the coverage. Bias, in the parameter's unit: mean of "
        "posterior mean minus truth. Contraction: 1 − mean posterior variance / prior variance."
    )
    return Table(caption, columns, tuple(rows), note)


def _rows(experiment: Experiment, nominal: float) -> list[Row]:
    own, acquisition = (
        {str(row["parameter"]): row for row in records(table[table["nominal"] == nominal])}
        for table in (experiment.recovery.own, experiment.recovery.acquisition)
    )
    return [
        Row(
            (
                experiment.name,
                f"{numbers.PARAMETERS[name]}, {numbers.PARAMETER_UNITS[name]}",
                numbers.percent(nominal, 0),
                *_recovery_cells(own[name]),
                *_recovery_cells(acquisition[name]),
                numbers.fixed(own[name]["bias"], 2),
                numbers.fixed(acquisition[name]["bias"], 2),
                numbers.fixed(own[name]["contraction"], 3),
            )
        )
        for name in numbers.PARAMETERS
    ]


def _recovery_cells(row: Mapping[Hashable, Any]) -> tuple[Cell, ...]:
    interval = numbers.span(numbers.percent(row["ci_low"]), numbers.percent(row["ci_high"]))
    return f"{numbers.percent(row['coverage'])} ({interval})", numbers.count(row["n"])


def differences_table(experiments: Sequence[Experiment], main: Experiment) -> Table:
    """Return the settings in which each experiment differs from the main one.

    One of another kind, which has other settings altogether, differs in its kind.
    """
    reference = dict(_leaves(main.settings))
    rows: list[tuple[Cell, ...]] = []
    for experiment in experiments:
        if experiment.exact != main.exact:
            rows.append((experiment.name, "kind", *(_KINDS[kind_of.exact] for kind_of in (main, experiment))))
            continue
        settings = dict(_leaves(experiment.settings))
        changed = [key for key in {**reference, **settings} if settings.get(key) != reference.get(key)]
        rows.extend(
            (experiment.name, key, _value(reference.get(key)), _value(settings.get(key))) for key in changed
        )
    columns = words("Experiment", "Setting", f"In {main.name}", "Here")
    return Table(f"What differs from the experiment {main.name}.", columns, body(rows))


def comparison_table(experiments: Sequence[Experiment], cohort_title: str) -> Table:
    """Return one column an experiment: support, scores, correlations, coverages, training."""
    lines = [(label, [value(experiment) for experiment in experiments]) for label, value in _measures()]
    columns = (
        Column("Mean ± sd over prior-supported subjects", numeric=False),
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
        (
            subject,
            label,
            numbers.PARAMETER_UNITS[name],
            *(medians.get((subject, name), numbers.MISSING) for medians in cells),
        )
        for subject in dict.fromkeys(name for each in experiments for name in each.verdicts)
        for name, label in numbers.PARAMETERS.items()
    ]
    note = (
        "Median and credible interval; a dash where the experiment does not have the subject, or its prior "
        "does not support it."
    )
    return Table(f"Posterior medians by experiment ({cohort_title}).", columns, body(rows), note)


def correlations(experiment: Experiment, one: str, other: str) -> list[float]:
    """Return the posterior correlation of two parameters in every subject that may be read."""
    table = experiment.posterior
    rows = table[(table["parameter"] == one) & table["may_be_read"]]
    return [float(value) for value in rows[f"correlation_{other}"]]


def _measures() -> Iterator[tuple[str, Callable[[Experiment], str]]]:
    yield "Subjects prior-supported", _passed
    for label, column, scale, decimals in SCORES:
        yield label, partial(_score, column=column, scale=scale, decimals=decimals)
    for one, other in PAIRS:
        label = f"Correlation of {numbers.PARAMETERS[one]} and {numbers.PARAMETERS[other]}"
        yield label, partial(_correlation, one=one, other=other)
    for name, symbol in numbers.PARAMETERS.items():
        yield f"Recovery coverage of {symbol} (%)", partial(_coverage, parameter=name)
    yield "Epochs trained", lambda experiment: numbers.count(len(experiment.training))
    yield (
        "Lowest validation loss",
        lambda experiment: numbers.fixed(experiment.training["validation_loss"].min(), 2),
    )


def _score(experiment: Experiment, *, column: str, scale: float, decimals: int) -> str:
    return numbers.mean_sd(scale * experiment.passed[column].to_numpy(), decimals)


def _correlation(experiment: Experiment, *, one: str, other: str) -> str:
    return numbers.mean_sd(correlations(experiment, one, other), 2)


def _coverage(experiment: Experiment, *, parameter: str) -> str:
    return numbers.percent(level(experiment.recovery.own, experiment).get(parameter, math.nan))


def _passed(experiment: Experiment) -> str:
    names = [subject for subject, verdict in experiment.verdicts.items() if verdict.may_be_read]
    return f"{len(names)} of {len(experiment.verdicts)}" + (f" ({', '.join(names)})" if names else "")


def _medians(experiment: Experiment) -> dict[tuple[str, str], str]:
    table = experiment.posterior
    rows = records(table[table["parameter"].isin(numbers.PARAMETERS) & table["may_be_read"]])
    return {
        (str(row["subject"]), str(row["parameter"])): "{} ({})".format(
            *numbers.estimate(row["median"], row["ci_low"], row["ci_high"])
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
        return numbers.MISSING
    return f"{value:g}" if isinstance(value, float) else json.dumps(value, ensure_ascii=False).strip('"')


def training_table(experiments: Sequence[Experiment]) -> Table:
    """Return how long each estimator was trained, and what it reached."""
    columns = (
        Column("Experiment", numeric=False),
        Column("Epochs trained"),
        Column("Epoch of the lowest validation loss"),
        Column("Lowest validation loss"),
        Column("Training loss there"),
        Column("Validation loss at the end"),
    )
    note = "Loss: mean of −log q(θ | z) over the rows of the pool."
    return Table("Training of the estimators.", columns, tuple(map(_row, experiments)), note)


def _row(experiment: Experiment) -> Row:
    history = experiment.training
    best = records(history)[int(history["validation_loss"].argmin())]
    return Row(
        (
            experiment.name,
            numbers.count(len(history)),
            numbers.count(best["epoch"]),
            numbers.fixed(best["validation_loss"], 2),
            numbers.fixed(best["training_loss"], 2),
            numbers.fixed(history["validation_loss"].iloc[-1], 2),
        )
    )


def read_comparison(path: Path) -> pd.DataFrame:
    """Read ``paper_comparison.csv`` as text, as it was written.

    Raises:
        ArtefactError: A column is missing.
    """
    return checked(pd.read_csv(path, dtype=str, keep_default_na=False), path, COLUMNS)


def paper_table(comparison: pd.DataFrame, cohort_title: str) -> Table:
    """Return the comparison; numbers keep the digits that the table of the study gives them."""
    columns = words("Quantity", "Paper", "This study", "Reading", "Designed or found")
    rows = tuple(
        Row(
            (
                str(row["quantity"]),
                _number(row["paper"]),
                _number(row["this_study"]),
                str(row["note"]),
                marked(str(row["origin"])),
            )
        )
        for row in records(comparison)
    )
    note = (
        f"{MARK} Designed: a choice of this study, whose place stands in brackets, brought the value or its "
        "agreement with the paper about; it is no finding, however it is read."
    )
    return Table(f"Every number of the paper, and of this study ({cohort_title}).", columns, rows, note)


def marked(origin: str) -> str:
    """Return where a number comes from, with a mark where it is designed."""
    return f"{MARK} {origin}" if origin.startswith(DESIGNED) else origin


def _number(text: object) -> str:
    """Return a number with a true minus; text passes."""
    return (
        f"{numbers.MINUS}{str(text)[1:]}" if str(text)[:1] == "-" and str(text)[1:2].isdigit() else str(text)
    )
