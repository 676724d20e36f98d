"""The table of comparison as LaTeX: a booktabs longtable, with a heading for each group of rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import pandas as pd

from swesbi.tables.latex import escape
from swesbi.tables.paper_values import PaperNumber

SYMBOLS = {"±": r"$\pm$", "→": r"$\rightarrow$", "−": r"$-$", "_": r"\_\allowbreak{}"}
HEAD = r"Quantity & Paper & This study & Reading \\"
COLUMNS = (
    r">{\raggedright\arraybackslash}p{0.27\linewidth}"
    r">{\raggedright\arraybackslash}p{0.12\linewidth}"
    r">{\raggedright\arraybackslash}p{0.22\linewidth}"
    r">{\raggedright\arraybackslash}p{0.29\linewidth}"
)


def comparison_latex(paper: Sequence[PaperNumber], table: pd.DataFrame, cohort_title: str) -> str:
    """Return the table as a longtable; it needs the packages array, booktabs and longtable.

    Args:
        paper: The paper's numbers, in the order of the rows.
        table: As ``comparison_table`` returns it.
        cohort_title: What the subjects are ("virtual volunteers").
    """
    lines = [
        r"{\footnotesize\setlength{\tabcolsep}{3.5pt}",
        rf"\begin{{longtable}}{{@{{}}{COLUMNS}@{{}}}}",
        rf"    \caption{{{_caption(cohort_title)}}}\label{{tab:paper-comparison}}\\",
        *_head(r"\endfirsthead"),
        *_head(r"\endhead"),
        r"    \bottomrule \endlastfoot",
        *_body(paper, table),
        r"\end{longtable}}",
    ]
    return "\n".join(lines) + "\n"


def text(plain: str) -> str:
    """Return text for LaTeX: special characters escaped, symbols as mathematics, names may break at "_"."""
    return "".join(SYMBOLS.get(character, escape(character)) for character in plain)


def _caption(cohort_title: str) -> str:
    return (
        rf"\textbf{{Every number of the paper}} beside this study's ({text(cohort_title)}). Cases A to D "
        r"of the paper and the subjects of these names here are different people. Means and standard "
        r"deviations are over the supported subjects."
    )


def _head(end: str) -> list[str]:
    return [r"    \toprule", f"    {HEAD}", rf"    \midrule {end}"]


def _body(paper: Sequence[PaperNumber], table: pd.DataFrame) -> Iterator[str]:
    group = ""
    for number, row in zip(paper, table.itertuples(index=False), strict=True):
        if number.group != group:
            if group:
                yield r"    \addlinespace"
            group = number.group
            yield rf"    \multicolumn{{4}}{{@{{}}l}}{{\textit{{{text(group)}}}}} \\*"
        yield f"    {' & '.join(text(str(cell)) for cell in row)} \\\\"
