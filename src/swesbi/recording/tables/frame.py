"""Tables in memory as columns of text: a pandas DataFrame, or arrays of one length, as strict as a file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from swesbi.recording.problems import refusal
from swesbi.recording.tables.table import Table, shortest, table_of

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = "name its columns as those of a file: texts, each once"


def table_of_frame(frame: pd.DataFrame, source: str) -> Table:
    """Return a DataFrame as a table; its rows count from 1, and an index with a name is a column."""
    if frame.columns.nlevels > 1:
        raise refusal(source, "has names of columns in several levels", COLUMNS)
    if any(name is not None for name in frame.index.names):
        frame = frame.reset_index()
    header = [str(name) for name in frame.columns]
    rows = [list(map(_as_text, row)) for row in frame.itertuples(index=False, name=None)]
    return table_of(source, [(0, header), *enumerate(rows, start=1)], COLUMNS)


def table_of_arrays(arrays: Mapping[str, Any], source: str) -> Table:
    """Return arrays of one length, by the columns that they are; None is left out."""
    import pandas as pd

    given = {name: np.asarray(values) for name, values in arrays.items() if values is not None}
    for name, values in given.items():
        if values.ndim != 1:
            raise refusal(
                source, f"is an array of {values.ndim} dimensions", "give one value a push", column=name
            )
    sizes = {name: len(values) for name, values in given.items()}
    if len(set(sizes.values())) > 1:
        listed = ", ".join(f"{name} {size}" for name, size in sizes.items())
        raise refusal(source, f"its arrays differ in length ({listed})", "give every push a value in each")
    return table_of_frame(pd.DataFrame(given), source)


def _as_text(value: object) -> str:
    """Return a cell as a file would have it: nothing for what is missing."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.number):
        missing = value is None or value != value or repr(value) == "<NA>"  # noqa: PLR0124
        return "" if missing else str(value)
    return "" if np.isnan(value) else shortest(float(value))
