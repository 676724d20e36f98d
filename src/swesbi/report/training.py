"""Training of each experiment's estimator, in a row of numbers."""

from __future__ import annotations

from collections.abc import Sequence

from swesbi.report.numbers import count, fixed
from swesbi.report.results import Experiment, records
from swesbi.report.table import Column, Row, Table


def training_table(experiments: Sequence[Experiment]) -> Table:
    """Return how long each estimator was trained, and what it reached."""
    columns = (
        Column("Experiment", numeric=False),
        Column("Epochs trained"),
        Column("Epoch of the lowest validation loss"),
        Column("Lowest validation loss"),
        Column("Training loss there"),
    )
    note = "Loss: mean of −log q(θ | z) over the rows of the pool."
    return Table("Training of the estimators.", columns, tuple(map(_row, experiments)), note)


def _row(experiment: Experiment) -> Row:
    history = experiment.training
    best = records(history)[int(history["validation_loss"].argmin())]
    return Row(
        (
            experiment.name,
            count(len(history)),
            count(best["epoch"]),
            fixed(best["validation_loss"], 2),
            fixed(best["training_loss"], 2),
        )
    )
