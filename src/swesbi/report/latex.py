"""Tables of the study as LaTeX with booktabs: predictive scores, posteriors, comparison with the paper."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from typing import Any, Final

import pandas as pd

from swesbi.parameters import THETA_LABELS, THETA_NAMES
from swesbi.report.paper.values import PaperNumber
from swesbi.report.study_tables import CEILING, CORRELATIONS

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
PPC_HEAD = (
    r"Case", r"\shortstack{RMSE\\prior $\rightarrow$ SBI}", r"\shortstack{RMSE\\reduction (\%)}", r"NRMSE",
    r"$R^2$", r"\shortstack{Post-peak\\RMSE}", r"\shortstack{Coverage,\\noiseless\\grid / phases}",
    r"\shortstack{RMSE\\CMA-ES}", r"\shortstack{Coverage,\\with noise\\grid / phases}",
    r"\shortstack{Coverage\\by the prior's\\band / envelope}",
)  # fmt: skip
AVERAGED = (("rmse_reduction_percent", 1), ("nrmse", 3), ("r2", 3), ("post_peak_rmse_kpa", 2))
_CAPTION = (
    r"RMSEs are in kPa, of the predictive median against the observed curve on the analysis grid; reduction "
    r"is relative to the prior predictive median. Coverage, noiseless: of the observed curve by the "
    r"posterior's band of noiseless curves, on the grid and on the measured phases; with noise: by the "
    r"predictive interval under the observation model; by the prior's: what its band of noiseless curves and "
    r"their envelope hold of the grid, the ceiling of the first. Mean and standard deviation are over the "
    r"cases that may be read."
)
POSTERIOR_HEAD: Final = (
    r"Case & Quantity & Median & CI & Measured & CMA-ES & $r_{k_0}$ & $r_{k_\mathrm{ATP}}$ "
    r"& $r_{k_\mathrm{SR}}$ \\"
)
NAMES: Final = {
    **dict(zip(THETA_NAMES, THETA_LABELS, strict=True)),
    "ejection_fraction": "ejection fraction",
    "end_diastolic_volume_ml": "LVEDV (mL)",
    "end_systolic_volume_ml": "LVESV (mL)",
    "peak_stiffness_kpa": "peak stiffness (kPa)",
    "isometric_stiffness_kpa": r"$k_0 (1 - e^{-k_\mathrm{ATP} D_T})$ (kPa)",
}
CAPTION: Final = (
    r"Medians and credible intervals of the parameters, and of what follows from them in the simulated beat; "
    r"$D_T$ is the duration of activation at the subject's heart rate. Measured volumes are those of the "
    r"subject's context; none of them is fitted. $r$: posterior correlations. CMA-ES: reference fit."
)
Row = Mapping[Hashable, Any]
SYMBOLS = {"±": r"$\pm$", "→": r"$\rightarrow$", "−": r"$-$", "_": r"\_\allowbreak{}"}
COMPARISON_HEAD = r"Quantity & Paper & This study & Reading & Origin \\"
COLUMNS = (
    r">{\raggedright\arraybackslash}p{0.23\linewidth}"
    r">{\raggedright\arraybackslash}p{0.10\linewidth}"
    r">{\raggedright\arraybackslash}p{0.19\linewidth}"
    r">{\raggedright\arraybackslash}p{0.24\linewidth}"
    r">{\raggedright\arraybackslash}p{0.10\linewidth}"
)


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
        r"    \scriptsize",
        r"    \setlength{\tabcolsep}{2.5pt}",
        r"    \begin{tabular}{@{}lccccccccc@{}}",
        r"        \toprule",
        f"        {' & '.join(PPC_HEAD)} \\\\",
        *_ppc_body(table, reasons),
        r"        \bottomrule",
        r"    \end{tabular}",
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def _ppc_body(table: pd.DataFrame, reasons: Mapping[tuple[str, str], str]) -> Iterator[str]:
    several = table["experiment"].nunique() > 1
    for experiment, part in table.groupby("experiment", sort=False):
        yield r"        \midrule"
        if several:
            yield rf"        \multicolumn{{10}}{{@{{}}l}}{{\textit{{{escape(str(experiment))}}}}} \\"
        for row in part.to_dict("records"):
            yield _scores(row) if row["may_be_read"] else _excluded(row, reasons)
        if part["may_be_read"].sum() > 1:
            yield from _mean_and_sd(part[part["may_be_read"]])


def _scores(row: Mapping[Hashable, Any]) -> str:
    return _line(rf"\textbf{{{escape(str(row['subject']))}}}", row)


def _line(label: str, row: Mapping[Hashable, Any]) -> str:
    cells = [
        label,
        rf"${row['rmse_prior_kpa']:.2f} \rightarrow {row['rmse_kpa']:.2f}$",
        *(f"${row[name]:.{digits}f}$" for name, digits in AVERAGED),
        _pair(row, "coverage_noiseless_grid", "coverage_noiseless_phases"),
        f"{row['rmse_cmaes_kpa']:.2f}",
        _pair(row, "coverage_observed_grid", "coverage_observed_phases"),
        _pair(row, *CEILING),
    ]
    return f"        {' & '.join(cells)} \\\\"


def _pair(row: Mapping[Hashable, Any], one: str, other: str) -> str:
    return f"{row[one]:.2f} / {row[other]:.2f}"


def _excluded(row: Mapping[Hashable, Any], reasons: Mapping[tuple[str, str], str]) -> str:
    reason = escape(reasons[str(row["experiment"]), str(row["subject"])])
    text = rf"\multicolumn{{5}}{{l}}{{excluded: {reason}}}"
    cells = [
        rf"\textbf{{{escape(str(row['subject']))}}}",
        rf"${row['rmse_prior_kpa']:.2f} \rightarrow$ --",
        text,
        f"{row['rmse_cmaes_kpa']:.2f}",
        "",
        _pair(row, *CEILING),
    ]
    return f"        {' & '.join(cells)} \\\\"


def _mean_and_sd(read: pd.DataFrame) -> Iterator[str]:
    """Two rows, since mean and standard deviation side by side would not fit the text width."""
    numbers = read.select_dtypes("number")
    yield _line(r"\addlinespace mean", numbers.mean().to_dict())
    yield _line("sd", numbers.std(ddof=1).to_dict())


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
        rf"    \toprule {POSTERIOR_HEAD} \midrule \endfirsthead",
        rf"    \toprule {POSTERIOR_HEAD} \midrule \endhead",
        r"    \bottomrule \endlastfoot",
        *_posterior_body(table, reasons),
        r"\end{longtable}}",
    ]
    return "\n".join(lines) + "\n"


def _posterior_body(table: pd.DataFrame, reasons: Mapping[tuple[str, str], str]) -> Iterator[str]:
    several = table["experiment"].nunique() > 1
    for experiment, part in table.groupby("experiment", sort=False):
        if several:
            yield rf"    \multicolumn{{9}}{{@{{}}l}}{{\textit{{{escape(str(experiment))}}}}} \\*"
        for subject, rows in part.groupby("subject", sort=False):
            yield from _subject(str(subject), rows, reasons[str(experiment), str(subject)])
            yield r"    \addlinespace"


def _subject(subject: str, rows: pd.DataFrame, reason: str) -> Iterator[str]:
    """Yield the rows of a subject that may be read, or reason and unfiltered medians of an excluded one."""
    head, records = rf"\textbf{{{escape(subject)}}}", rows.to_dict("records")
    if not records[0]["may_be_read"]:
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
        *_comparison_body(paper, table),
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
        r"deviations are over the prior-supported subjects. Designed: a choice of this study, named in "
        r"\texttt{paper\_comparison.csv}, brought the value or its agreement about."
    )


def _head(end: str) -> list[str]:
    return [r"    \toprule", f"    {COMPARISON_HEAD}", rf"    \midrule {end}"]


def _comparison_body(paper: Sequence[PaperNumber], table: pd.DataFrame) -> Iterator[str]:
    group = ""
    for number, row in zip(paper, table.itertuples(index=False), strict=True):
        if number.group != group:
            if group:
                yield r"    \addlinespace"
            group = number.group
            yield rf"    \multicolumn{{5}}{{@{{}}l}}{{\textit{{{text(group)}}}}} \\*"
        *cells, origin = map(str, row)
        yield f"    {' & '.join(map(text, (*cells, origin.split(' (')[0])))} \\\\"
