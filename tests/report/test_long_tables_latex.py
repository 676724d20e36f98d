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

from swesbi.report.study_tables import posterior_latex, posterior_table, ppc_latex, ppc_table
from swesbi.report.table import text

EXPERIMENTS = ("paper", "wide_prior")
PREAMBLE = r"\documentclass{article}\usepackage{booktabs,graphicx,longtable}\begin{document}"
ENGINE = next((name for name in ("pdflatex", "lualatex", "xelatex", "tectonic") if shutil.which(name)), None)


def render(name: str, *experiments: str) -> str:
    all_cases = cases(*(experiments or EXPERIMENTS))
    verdicts = {(case.experiment, case.subject): case.verdict for case in all_cases}
    if name == "ppc":
        return ppc_latex(ppc_table(all_cases), verdicts, TITLE)
    return posterior_latex(posterior_table(all_cases), verdicts, TITLE)


def assert_syntax(latex: str) -> None:
    """Fail where braces, environments or dollars do not balance, or a character needs a package."""
    bare = re.sub(r"\\[{}$&%#_\\]", "", latex.replace(r"\\", r"\newline"))
    depth = np.cumsum([{"{": 1, "}": -1}.get(character, 0) for character in bare])
    assert depth.min() >= 0 and depth[-1] == 0
    assert bare.count("$") % 2 == 0
    assert re.findall(r"\\begin\{(\w+)\}", latex) == re.findall(r"\\end\{(\w+)\}", latex)[::-1]
    assert latex.isascii() and "nan" not in latex
    assert not re.search(r"(?<!\\)[%#]", latex)


def assert_compiles(folder: Path, *tables: str) -> None:
    """Fail where a TeX engine does, if there is one."""
    if ENGINE is None:
        return
    (folder / "tables.tex").write_text(PREAMBLE + "\n\n".join(tables) + r"\end{document}", encoding="utf-8")
    options = [] if ENGINE == "tectonic" else ["-halt-on-error", "-interaction=nonstopmode"]
    command = [ENGINE, *options, "tables.tex"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(("name", "width"), [("ppc", 14), ("posterior", 10)])
def test_syntax_holds_and_every_row_has_its_cells(name: str, width: int, tmp_path: Path) -> None:
    latex = render(name)
    assert_syntax(latex)
    assert_compiles(tmp_path, latex)
    rows = latex.split(r"\endlastfoot")[1].split(r"\end{longtable}")[0].splitlines()
    plain = [row for row in rows if row and r"\multicolumn" not in row]
    assert len(plain) > 10 and len(rows) - len(plain) > 1
    assert all(row.endswith(r" \\") for row in plain)
    assert {len(re.findall(r"(?<!\\)&", row)) + 1 for row in plain} == {width}


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
    scores = ppc_table(cases("paper"))
    mean = scores.loc[scores["may_be_read"], "rmse_prior_kpa"].mean()
    assert ppc.count(f"    mean & {mean:.2f} & ") == ppc.count("    sd & ") == len(EXPERIMENTS)
    assert posterior.count("& ejection fraction &") == 2 * 4
    assert re.search(r"E & \$k_\\mathrm\{0\}\$ & kPa & -- & -- & -- & -- & -- & 58\.0 &", posterior)
    assert r"\textit" not in render("ppc", "paper")


def test_symbols_become_mathematics_and_special_characters_are_escaped() -> None:
    assert text("1 ± 2 → 3_b, k_ATP") == r"1 $\pm$ 2 $\rightarrow$ 3\_\allowbreak{}b, $k_\mathrm{ATP}$"
    assert text(r"50%a&b#c{d}\~^$<") == (
        r"50\%a\&b\#c\{d\}\textbackslash{}\textasciitilde{}\textasciicircum{}\$\textless{}"
    )


def test_tables_of_a_finished_study(finished: StudyCopy, tmp_path: Path) -> None:
    tables = [path.read_text(encoding="utf-8") for path in (finished.results / "tables").glob("*.tex")]
    assert len(tables) >= 2
    for table in tables:
        assert_syntax(table)
    assert_compiles(tmp_path, *tables)
