"""Table 1 as LaTeX: braces balance, cells count, special characters are escaped, exclusions are said."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd

from swesbi.report.latex import escape, ppc_latex
from swesbi.report.study_tables import PPC_COLUMNS

TITLE = "virtual volunteers"
REASON = "0 in-prior draws, max |z| = 3.14"


def table(*experiments: str) -> pd.DataFrame:
    rows = []
    for experiment in experiments:
        for subject, supported in (("A", True), ("B_2", True), ("E", False)):
            scores = [1.0, 80.0, 0.02, 0.99, 1.1, 0.97, 0.95] if supported else [np.nan] * 7
            readings = [0.97, 0.95, 0.99, 0.98] if supported else [np.nan] * 4
            rows.append([experiment, subject, supported, 5.0, *scores, 1.4, *readings, 0.61, 0.74])
    return pd.DataFrame(rows, columns=list(PPC_COLUMNS))


def render(*experiments: str) -> str:
    scores = table(*experiments)
    keys = zip(scores["experiment"], scores["subject"], strict=True)
    return ppc_latex(scores, dict.fromkeys(keys, REASON), TITLE)


def test_every_row_has_ten_cells() -> None:
    body = render("paper", "wide_prior").split(r"\toprule")[1].split(r"\bottomrule")[0]
    rows = [line for line in body.splitlines() if line.rstrip().endswith(r"\\")]
    assert len(rows) == 1 + 2 * (1 + 5)
    for row in rows:
        spans = [int(width) for width in re.findall(r"\\multicolumn\{(\d+)\}", row)]
        cells = len(re.findall(r"(?<!\\)&", row)) + 1
        assert cells + sum(spans) - len(spans) == 10, row


def test_one_experiment_needs_no_heading_and_averages_the_supported() -> None:
    text = render("paper")
    assert r"\textit{paper}" not in text and TITLE in text
    assert r"B\_2" in text and f"excluded: {escape(REASON)}" in text and "|" not in text
    mean, sd = text.split(r"\addlinespace mean")[1].splitlines()[:2]
    assert r"$5.00 \rightarrow 1.00$ & $80.0$" in mean and "$0.0$" in sd and "nan" not in text
    assert r"\textit{wide\_prior}" in render("paper", "wide_prior")


def test_special_characters_are_escaped() -> None:
    assert escape(r"50%_a&b#c{d}\~^$") == (
        r"50\%\_a\&b\#c\{d\}\textbackslash{}\textasciitilde{}\textasciicircum{}\$"
    )
