"""Tables of the study as LaTeX; a document needs the packages booktabs, graphicx and longtable."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

import pandas as pd

from swesbi.report.columns import named
from swesbi.report.numbers import SYMBOL
from swesbi.report.results import PASSED
from swesbi.report.table import Cell, Column, Strong, Table
from swesbi.report.tables.subjects import (
    DERIVED,
    POSTERIOR,
    SCORES,
    derived_of,
    parameters_of,
    with_mean,
)
from swesbi.verdict.summary import verdict_numbers
from swesbi.verdict.verdict import Verdict

SPECIAL: Final = str.maketrans(
    {character: rf"\{character}" for character in "&%$#{}"}
    | {
        "\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "|": r"\textbar{}",
        "<": r"\textless{}", ">": r"\textgreater{}", "_": r"\_\allowbreak{}", "χ": r"$\chi$", "±": r"$\pm$",
        "→": r"$\rightarrow$", "−": "$-$", "–": "--", "⁻": r"\textsuperscript{$-$}",
        "¹": r"\textsuperscript{1}", "²": r"\textsuperscript{2}",
    }
)  # fmt: skip
GROUP: Final = "group"
"""The column of a dataframe whose values head the rows below them."""
Verdicts = Mapping[tuple[str, str], Verdict]
"""By (experiment, subject)."""


def text(plain: str) -> str:
    """Return text for LaTeX: special characters escaped, symbols as mathematics, names may break at "_"."""
    parts = SYMBOL.split(plain)
    return parts[0].translate(SPECIAL) + "".join(
        rf"${letter}_\mathrm{{{index}}}$" + rest.translate(SPECIAL)
        for letter, index, rest in zip(parts[1::3], parts[2::3], parts[3::3], strict=True)
    )


def latex(table: Table, label: str) -> str:
    """Return a table as a longtable, its note below the caption; heads of numbers are turned.

    Where its dataframe has a column ``GROUP`` of several values, these are headings.
    """
    layout = "".join("r" if column.numeric else "l" for column in table.columns)
    head = rf"    \toprule {' & '.join(map(_head, table.columns))} \\ \midrule"
    return "\n".join(
        [
            r"{\scriptsize\setlength{\tabcolsep}{2.5pt}",
            rf"\begin{{longtable}}{{@{{}}{layout}@{{}}}}",
            rf"    \caption{{{text(table.caption)} {text(table.note)}}}\label{{tab:{label}}}\\",
            rf"{head} \endfirsthead",
            rf"{head} \endhead",
            r"    \bottomrule \endlastfoot",
            *_body(table),
            r"\end{longtable}}",
            "",
        ]
    )


def _head(column: Column) -> str:
    head = text(column.heading)
    return rf"\rotatebox{{90}}{{{head}}}" if column.numeric else head


def _body(table: Table) -> Iterator[str]:
    groups = list(table.frame.get(GROUP, [""] * len(table.frame)))
    several, before = len(set(groups)) > 1, ""
    across = rf"\multicolumn{{{len(table.columns)}}}{{@{{}}l}}"
    for group, row in zip(groups, table.rows, strict=True):
        if several and group != before:
            yield rf"    \addlinespace {across}{{\textit{{{text(group)}}}}} \\*"
            before = group
        yield f"    {' & '.join(map(_cell, row.cells))} \\\\"


def _cell(cell: Cell) -> str:
    return rf"\textbf{{{text(cell.text)}}}" if isinstance(cell, Strong) else text(str(cell))


def ppc_latex(scores: pd.DataFrame, verdicts: Verdicts, cohort_title: str) -> str:
    """Return table 1 of every experiment; scores are as ``ppc_table`` returns them."""
    parts = []
    for experiment, part in scores.groupby("experiment", sort=False):
        passed = [verdicts[str(experiment), subject].status in PASSED for subject in part["subject"]]
        parts.append(with_mean(part, part[passed]).assign(**{GROUP: experiment}))
    table = Table(
        f"Posterior predictive performance ({cohort_title}).",
        pd.concat(parts),
        named("subject", *SCORES),
        "Coverage: share of the observed curve in the band of noiseless curves, or in the interval of new "
        "observations. The prior's band and envelope are the ceiling of the first. Mean and standard "
        f"deviation: of subjects whose answers may be read without care. {_excluded(verdicts)}",
    )
    return latex(table, "ppc")


def posterior_latex(posterior: pd.DataFrame, verdicts: Verdicts, cohort_title: str) -> str:
    """Return the posteriors of every experiment: the parameters, then what follows from them.

    ``posterior`` is as ``posterior_table`` returns it.
    """
    table = posterior.assign(**{GROUP: posterior["experiment"]})
    parameters = Table(
        f"Posteriors of the parameters ({cohort_title}).",
        parameters_of(table),
        named("subject", "parameter", "unit", *POSTERIOR),
        _excluded(verdicts),
    )
    derived = Table(
        f"What follows from the posteriors in the simulated beat ({cohort_title}).",
        derived_of(table),
        named(*DERIVED),
        "Measured volumes are those of the subject's context; none of them is fitted.",
    )
    return latex(parameters, "posterior") + "\n" + latex(derived, "derived")


def _excluded(verdicts: Verdicts) -> str:
    """Return who is excluded, and why."""
    excluded = [
        f"{experiment} {subject} ({', '.join(verdict_numbers(verdict))})"
        for (experiment, subject), verdict in verdicts.items()
        if not verdict.may_be_read
    ]
    return f"Excluded: {'; '.join(excluded)}." if excluded else ""
