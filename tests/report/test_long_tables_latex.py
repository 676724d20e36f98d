"""The long tables as LaTeX: they compile where a TeX engine is present, and their syntax holds anywhere."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from comparison_case import cases, study
from evaluation_cases import TITLE
from study_copy import StudyCopy

from swesbi.report.latex import comparison_latex, posterior_latex, ppc_latex, text
from swesbi.report.paper.comparison import comparison_table
from swesbi.report.paper.values import read_paper
from swesbi.report.study_tables import posterior_table, ppc_table
from swesbi.verdict.prior_support import support_numbers

EXPERIMENTS = ("paper", "wide_prior")
PREAMBLE = (
    r"\documentclass{article}\usepackage{amsmath,array,booktabs,longtable}"
    r"\begin{document}"
)
ENGINE = next((name for name in ("pdflatex", "lualatex", "xelatex", "tectonic") if shutil.which(name)), None)
NAMES = ("ppc", "posterior", "comparison")


def render(name: str) -> str:
    all_cases = cases(*EXPERIMENTS)
    reasons = {
        (case.experiment, case.subject): ", ".join(support_numbers(case.verdict)) for case in all_cases
    }
    if name == "ppc":
        return ppc_latex(ppc_table(all_cases), reasons, TITLE)
    if name == "posterior":
        return posterior_latex(posterior_table(all_cases), reasons, TITLE)
    paper = read_paper()
    return comparison_latex(paper, comparison_table(paper, study(*EXPERIMENTS)), TITLE)


def assert_syntax(latex: str) -> None:
    """Fail where braces, environments or dollars do not balance, or a row has other than its cells."""
    bare = re.sub(r"\\[{}$&%#_\\]", "", latex.replace(r"\\", r"\newline"))
    depth = np.cumsum([{"{": 1, "}": -1}.get(character, 0) for character in bare])
    assert depth.min() >= 0 and depth[-1] == 0
    assert bare.count("$") % 2 == 0
    assert re.findall(r"\\begin\{(\w+)\}", latex) == re.findall(r"\\end\{(\w+)\}", latex)[::-1]
    assert latex.isascii() and "nan" not in latex
    assert not re.search(r"(?<!\\)[%#]", latex)


def cells(row: str) -> int:
    spans = [int(width) for width in re.findall(r"\\multicolumn\{(\d)\}", row)]
    return len(re.findall(r"(?<!\\)&", row)) + 1 + sum(spans) - len(spans)


@pytest.mark.parametrize("name", NAMES)
def test_syntax_holds(name: str) -> None:
    latex = render(name)
    assert_syntax(latex)
    assert TITLE in latex


@pytest.mark.parametrize(("name", "width"), [("posterior", 9), ("comparison", 5)])
def test_every_row_has_its_cells(name: str, width: int) -> None:
    body = render(name).split(r"\endlastfoot")[1].split(r"\end{longtable}")[0]
    rows = [line for line in body.splitlines() if re.search(r"\\\\\*?$", line)]
    assert len(rows) > 30
    for row in rows:
        assert cells(row) == width, row


def test_the_syntax_check_can_fail() -> None:
    good = render("comparison")
    for bad in (good.replace("{", "", 1), good + "$", good.replace(r"\_", "%", 1), good + "±"):
        with pytest.raises(AssertionError):
            assert_syntax(bad)


def test_posteriors_are_complete_and_exclusions_are_said() -> None:
    latex = render("posterior")
    assert latex.count("ejection fraction &") == 2 * 4 and latex.count("excluded: ") == 2 * 2
    assert latex.count("unfiltered medians: $k_0$ (kPa) 58.00") == 2
    assert r"\textit{wide\_prior}" in latex
    measured = re.search(r"ejection fraction & \S+ & .*?\] & (\S+) &", latex)
    assert measured is not None and float(measured[1]) == pytest.approx(1.0 - 40.0 / 105.0, abs=1e-4)


def test_symbols_become_mathematics() -> None:
    assert text("1 ± 2 → 3_b") == r"1 $\pm$ 2 $\rightarrow$ 3\_\allowbreak{}b"


def compile_tables(folder: Path, tables: list[str]) -> None:
    assert ENGINE is not None
    (folder / "tables.tex").write_text(PREAMBLE + "\n\n".join(tables) + r"\end{document}", encoding="utf-8")
    options = [] if ENGINE == "tectonic" else ["-halt-on-error", "-interaction=nonstopmode"]
    done = subprocess.run(
        [ENGINE, *options, "tables.tex"], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert (folder / "tables.pdf").stat().st_size > 1000


@pytest.mark.skipif(ENGINE is None, reason="no TeX engine on PATH; the syntax is checked instead")
@pytest.mark.parametrize("name", NAMES)
def test_compiles(name: str, tmp_path: Path) -> None:
    compile_tables(tmp_path, [render(name)])


def test_tables_of_a_finished_study(finished: StudyCopy, tmp_path: Path) -> None:
    files = sorted((finished.results / "tables").glob("*.tex"))
    assert {file.name for file in files} >= {"ppc.tex", "posterior.tex", "paper_comparison.tex"}
    tables = [file.read_text(encoding="utf-8") for file in files]
    for table in tables:
        assert_syntax(table)
    if ENGINE is not None:
        compile_tables(tmp_path, tables)
