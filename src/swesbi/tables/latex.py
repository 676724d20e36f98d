"""Table 1 as LaTeX, set with booktabs like the paper's."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from typing import Any

import pandas as pd

ESCAPES = {
    "\\": r"\textbackslash{}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "|": r"\textbar{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "χ": r"$\chi$",
    "²": r"\textsuperscript{2}",
}
HEAD = (
    r"Case",
    r"\shortstack{RMSE\\prior $\rightarrow$ SBI}",
    r"\shortstack{RMSE\\reduction (\%)}",
    r"NRMSE",
    r"$R^2$",
    r"\shortstack{Post-peak\\RMSE}",
    r"\shortstack{Coverage\\grid / phases}",
    r"\shortstack{RMSE\\CMA-ES}",
)
AVERAGED = (("rmse_reduction_percent", 1), ("nrmse", 3), ("r2", 3), ("post_peak_rmse_kpa", 2))


def escape(text: str) -> str:
    """Return text with LaTeX's special characters escaped."""
    return "".join(ESCAPES.get(character, character) for character in text)


def ppc_latex(table: pd.DataFrame, reasons: Mapping[tuple[str, str], str], cohort_title: str) -> str:
    """Return the predictive scores as a LaTeX table; it needs the package booktabs.

    Args:
        table: As ``ppc_table`` returns it.
        reasons: By (experiment, subject), in short why a subject is excluded.
        cohort_title: What the subjects are ("virtual volunteers").
    """
    lines = [
        r"\begin{table}[ht]",
        r"    \centering",
        rf"    \caption{{\textbf{{Posterior predictive performance}} ({escape(cohort_title)}). {_CAPTION}}}",
        r"    \label{tab:ppc}",
        r"    \footnotesize",
        r"    \setlength{\tabcolsep}{2.5pt}",
        r"    \begin{tabular}{@{}lccccccc@{}}",
        r"        \toprule",
        f"        {' & '.join(HEAD)} \\\\",
        *_body(table, reasons),
        r"        \bottomrule",
        r"    \end{tabular}",
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


_CAPTION = (
    r"RMSEs are in kPa, of the predictive median against the observed curve on the analysis grid; reduction "
    r"is relative to the prior predictive median. Coverage refers to the posterior predictive interval, on "
    r"the grid and on the measured phases. Mean and standard deviation are over the supported cases."
)


def _body(table: pd.DataFrame, reasons: Mapping[tuple[str, str], str]) -> Iterator[str]:
    several = table["experiment"].nunique() > 1
    for experiment, part in table.groupby("experiment", sort=False):
        yield r"        \midrule"
        if several:
            yield rf"        \multicolumn{{8}}{{@{{}}l}}{{\textit{{{escape(str(experiment))}}}}} \\"
        for row in part.to_dict("records"):
            yield _scores(row) if row["supported"] else _excluded(row, reasons)
        if part["supported"].sum() > 1:
            yield from _mean_and_sd(part[part["supported"]])


def _scores(row: Mapping[Hashable, Any]) -> str:
    return _line(rf"\textbf{{{escape(str(row['subject']))}}}", row)


def _line(label: str, row: Mapping[Hashable, Any]) -> str:
    cells = [
        label,
        rf"${row['rmse_prior_kpa']:.2f} \rightarrow {row['rmse_kpa']:.2f}$",
        *(f"${row[name]:.{digits}f}$" for name, digits in AVERAGED),
        f"{row['coverage_grid']:.2f} / {row['coverage_phases']:.2f}",
        f"{row['rmse_cmaes_kpa']:.2f}",
    ]
    return f"        {' & '.join(cells)} \\\\"


def _excluded(row: Mapping[Hashable, Any], reasons: Mapping[tuple[str, str], str]) -> str:
    reason = escape(reasons[str(row["experiment"]), str(row["subject"])])
    text = rf"\multicolumn{{5}}{{l}}{{excluded: {reason}}}"
    cells = [
        rf"\textbf{{{escape(str(row['subject']))}}}",
        rf"${row['rmse_prior_kpa']:.2f} \rightarrow$ --",
        text,
        f"{row['rmse_cmaes_kpa']:.2f}",
    ]
    return f"        {' & '.join(cells)} \\\\"


def _mean_and_sd(part: pd.DataFrame) -> Iterator[str]:
    """Two rows, since mean and standard deviation side by side would not fit the text width."""
    numbers = part.select_dtypes("number")
    yield _line(r"\addlinespace mean", numbers.mean().to_dict())
    yield _line("sd", numbers.std(ddof=1).to_dict())
