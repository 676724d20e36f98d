"""Recovery of known parameters: what the credible intervals cover, by two ways of making recordings."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import pandas as pd
from markupsafe import Markup

from swesbi.report.names import PARAMETER_UNITS, PARAMETERS
from swesbi.report.numbers import count, fixed, percent, span
from swesbi.report.results import Experiment, records
from swesbi.report.table import Cell, Column, Row, Table, words


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
    rows = [row for part in experiments for row in _rows(part, nearest_level(part.recovery.own, part))]
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
                Markup("{}, {}").format(PARAMETERS[name], PARAMETER_UNITS[name]),
                percent(nominal, 0),
                *_coverage(own[name]),
                *_coverage(acquisition[name]),
                fixed(own[name]["bias"], 2),
                fixed(acquisition[name]["bias"], 2),
                fixed(own[name]["contraction"], 3),
            )
        )
        for name in PARAMETERS
    ]


def _coverage(row: Mapping[Hashable, Any]) -> tuple[Cell, ...]:
    interval = span(percent(row["ci_low"]), percent(row["ci_high"]))
    return f"{percent(row['coverage'])} ({interval})", count(row["n"])
