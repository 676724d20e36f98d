"""The posteriors as LaTeX: a booktabs longtable, one block an experiment, one row a subject and quantity."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from typing import Any, Final

import pandas as pd

from swesbi.parameters import THETA_LABELS, THETA_NAMES
from swesbi.tables.latex import escape
from swesbi.tables.posterior import CORRELATIONS

HEAD: Final = (
    r"Case & Quantity & Median & CI & Measured & CMA-ES & $r_{k_0}$ & $r_{k_\mathrm{ATP}}$ "
    r"& $r_{k_\mathrm{SR}}$ \\"
)
NAMES: Final = {
    **dict(zip(THETA_NAMES, THETA_LABELS, strict=True)),
    "ejection_fraction": "ejection fraction",
    "end_diastolic_volume_ml": "LVEDV (mL)",
    "end_systolic_volume_ml": "LVESV (mL)",
    "peak_stiffness_kpa": "peak stiffness (kPa)",
    "attained_stiffness_kpa": r"$k_0 (1 - e^{-k_\mathrm{ATP} D_T})$ (kPa)",
}
CAPTION: Final = (
    r"Medians and credible intervals of the parameters, and of what follows from them in the simulated beat; "
    r"$D_T$ is the duration of activation at the subject's heart rate. Measured volumes are those of the "
    r"subject's context; none of them is fitted. $r$: posterior correlations. CMA-ES: reference fit."
)
Row = Mapping[Hashable, Any]


def posterior_latex(table: pd.DataFrame, reasons: Mapping[tuple[str, str], str], cohort_title: str) -> str:
    """Return the posteriors as a longtable; it needs the packages booktabs and longtable.

    Args:
        table: As ``posterior_table`` returns it.
        reasons: By (experiment, subject), in short why a subject is excluded.
        cohort_title: What the subjects are ("virtual volunteers").
    """
    lines = [
        r"{\scriptsize\setlength{\tabcolsep}{2pt}",
        r"\begin{longtable}{@{}llccccccc@{}}",
        rf"    \caption{{\textbf{{Posteriors}} ({escape(cohort_title)}). {CAPTION}}}",
        r"    \label{tab:posterior}\\",
        rf"    \toprule {HEAD} \midrule \endfirsthead",
        rf"    \toprule {HEAD} \midrule \endhead",
        r"    \bottomrule \endlastfoot",
        *_body(table, reasons),
        r"\end{longtable}}",
    ]
    return "\n".join(lines) + "\n"


def _body(table: pd.DataFrame, reasons: Mapping[tuple[str, str], str]) -> Iterator[str]:
    several = table["experiment"].nunique() > 1
    for experiment, part in table.groupby("experiment", sort=False):
        if several:
            yield rf"    \multicolumn{{9}}{{@{{}}l}}{{\textit{{{escape(str(experiment))}}}}} \\*"
        for subject, rows in part.groupby("subject", sort=False):
            yield from _subject(str(subject), rows, reasons[str(experiment), str(subject)])
            yield r"    \addlinespace"


def _subject(subject: str, rows: pd.DataFrame, reason: str) -> Iterator[str]:
    """Yield the rows of a supported subject, or the reason and the unfiltered medians of an excluded one."""
    head, records = rf"\textbf{{{escape(subject)}}}", rows.to_dict("records")
    if not records[0]["supported"]:
        medians = ", ".join(
            f"{NAMES[row['parameter']]} {_number(row['unfiltered_median'])}"
            for row in records
            if not pd.isna(row["unfiltered_median"])
        )
        yield rf"    {head} & \multicolumn{{8}}{{l}}{{excluded: {escape(reason)}}} \\*"
        yield rf"    & \multicolumn{{8}}{{l}}{{unfiltered medians: {medians}}} \\"
        return
    for position, row in enumerate(records):
        end = r"\\" if position == len(records) - 1 else r"\\*"
        yield f"    {' & '.join((head if position == 0 else '', *_cells(row)))} {end}"


def _cells(row: Row) -> tuple[str, ...]:
    name = str(row["parameter"])
    return (
        NAMES.get(name, escape(name)),
        _number(row["median"]),
        f"{{}}[{_number(row['ci_low'])}, {_number(row['ci_high'])}]",
        _number(row["measured"]),
        _number(row["cmaes"]),
        *(_correlation(row, name, column) for column in CORRELATIONS),
    )


def _correlation(row: Row, name: str, column: str) -> str:
    """Return a correlation; nothing where there is none, or of a parameter with itself."""
    value = row[column]
    return "" if pd.isna(value) or column.endswith(name) else f"${value:.2f}$"


def _number(value: float) -> str:
    """Return four significant digits; nothing where there is no value."""
    return "" if pd.isna(value) else f"{value:#.4g}".removesuffix(".")
