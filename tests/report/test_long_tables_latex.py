"""The long tables as LaTeX: they compile where a TeX engine is present, and their syntax holds anywhere."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from comparison_case import cases
from evaluation_cases import TITLE
from study_copy import StudyCopy

from swesbi.report.latex import posterior_latex, ppc_latex, text
from swesbi.report.study_tables import posterior_table, ppc_table

EXPERIMENTS = ("paper", "wide_prior")
PREAMBLE = (
    r"\documentclass{article}\usepackage{booktabs,graphicx,longtable}"
    r"\begin{document}"
)
ENGINE = next((name for name in ("pdflatex", "lualatex", "xelatex", "tectonic") if shutil.which(name)), None)
NAMES = ("ppc", "posterior")


def render(name: str) -> str:
    all_cases = cases(*EXPERIMENTS)
    verdicts = {(case.experiment, case.subject): case.verdict for case in all_cases}
    if name == "ppc":
        return ppc_latex(ppc_table(all_cases), verdicts, TITLE)
    return posterior_latex(posterior_table(all_cases), verdicts, TITLE)


def assert_syntax(latex: str) -> None:
    """Fail where braces, environments or dollars do not balance, or a row has other than its cells."""
    bare = re.sub(r"\\[{}$&%#_\\]", "", latex.replace(r"\\", r"\newline"))
    depth = np.cumsum([{"{": 1, "}": -1}.get(character, 0) for character in bare])
    assert depth.min() >= 0 and depth[-1] == 0
    assert bare.count("$") % 2 == 0
    assert re.findall(r"\\begin\{(\w+)\}", latex) == re.findall(r"\\end\{(\w+)\}", latex)[::-1]
    assert latex.isascii() and "nan" not in latex
    assert not re.search(r"(?<!\\)[%#]", latex)


@pytest.mark.parametrize("name", NAMES)
def test_syntax_holds(name: str) -> None:
    latex = render(name)
    assert_syntax(latex)
    assert TITLE in latex


@pytest.mark.parametrize(("name", "width"), [("ppc", 14), ("posterior", 10)])
def test_every_row_has_its_cells(name: str, width: int) -> None:
    rows = render(name).split(r"\endlastfoot")[1].split(r"\end{longtable}")[0].splitlines()
    plain = [row for row in rows if row and r"\multicolumn" not in row]
    assert len(plain) > 10 and len(rows) - len(plain) > 1
    for row in plain:
        assert row.endswith(r" \\") and len(re.findall(r"(?<!\\)&", row)) + 1 == width, row


def test_the_syntax_check_can_fail() -> None:
    good = render("posterior")
    for bad in (good.replace("{", "", 1), good + "$", good.replace(r"\_", "%", 1), good + "±"):
        with pytest.raises(AssertionError):
            assert_syntax(bad)


def test_exclusions_are_said_and_the_others_averaged() -> None:
    ppc, posterior = render("ppc"), render("posterior")
    for latex in (ppc, posterior):
        assert r"\textit{wide\_\allowbreak{}prior}" in latex
        assert latex.count("Excluded: paper E (") == 1 and latex.count(r"max \textbar{}z\textbar{}") == 2 * 2
    assert ppc.count("    mean & ") == ppc.count("    sd & ") == len(EXPERIMENTS)
    assert posterior.count("& ejection fraction &") == 2 * 4
    assert re.search(r"E & \$k_\\mathrm\{0\}\$ & kPa & -- & -- & -- & -- & -- & 58\.0 &", posterior)


def test_one_experiment_needs_no_heading() -> None:
    scores = ppc_table(cases("paper"))
    verdicts = {(case.experiment, case.subject): case.verdict for case in cases("paper")}
    assert r"\textit" not in ppc_latex(scores, verdicts, TITLE)


def test_symbols_become_mathematics_and_special_characters_are_escaped() -> None:
    assert text("1 ± 2 → 3_b, k_ATP") == r"1 $\pm$ 2 $\rightarrow$ 3\_\allowbreak{}b, $k_\mathrm{ATP}$"
    assert text(r"50%a&b#c{d}\~^$<") == (
        r"50\%a\&b\#c\{d\}\textbackslash{}\textasciitilde{}\textasciicircum{}\$\textless{}"
    )


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
    assert {file.name for file in files} >= {"ppc.tex", "posterior.tex"}
    tables = [file.read_text(encoding="utf-8") for file in files]
    for table in tables:
        assert_syntax(table)
    if ENGINE is not None:
        compile_tables(tmp_path, tables)
