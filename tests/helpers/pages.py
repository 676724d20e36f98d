"""The code blocks of the pages, and running them in their order, as a reader does who pastes them."""

from __future__ import annotations

import contextlib
import io
import math
import re
import shlex
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from study_copy import ROOT, StudyCopy

PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
FENCE = re.compile(
    r"^(?P<mark><!-- not run: [^\n]+ -->\n)?```(?P<language>\w*)\n(?P<code>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
NUMBER = re.compile(r"(?<![A-Za-z_])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
OF_PROCESSORS = 0.03
"""Share by which a printed number may differ from the page's, beside its last digit."""
INTERVAL = re.compile(r"^\s*\w+\s+(?P<median>[\d.]+)\s+\[(?P<lower>[\d.]+), (?P<upper>[\d.]+)\](?P<rest>.*)$")
"""A parameter's median and 90 % interval, with what stands behind them."""
OF_INTERVAL = 0.2
"""Share of its width, in the logarithm, by which an interval's ends and median may differ: of 400 effective
draws an end has a standard error of 3 %, the difference of two 4 %, twice that where the tail is long."""
OF_K_HAT = 0.3
"""By how much a Pareto shape may differ: it is estimated from the 200 largest weights, to .08."""
OF_EFFICIENCY = 0.35
"""By which share an efficiency may: it depends on few large weights."""


@dataclass(frozen=True)
class Block:
    """A code block of a page: where it begins, its language, its text, and whether it may be run."""

    page: str
    line: int
    language: str
    code: str
    runs: bool

    @property
    def place(self) -> str:
        return f"{self.page}:{self.line}"


def blocks_of(page: Path) -> list[Block]:
    """Return the code blocks of a page in their order; a comment `<!-- not run: why -->` marks one."""
    text = page.read_text(encoding="utf-8")
    name = str(page.relative_to(ROOT))
    return [
        Block(name, text.count("\n", 0, each.start()) + 1, each["language"], each["code"], not each["mark"])
        for each in FENCE.finditer(text)
    ]


def walk(blocks: Sequence[Block], study: StudyCopy, *, shell: bool) -> dict[str, str]:
    """Run the blocks of a page in a copy, which is the current folder; return what each printed, by place.

    Python blocks share one namespace. Blocks of commands are run where ``shell`` is set.
    """
    names: dict[str, Any] = {"__name__": "__main__"}
    printed = {}
    for block in blocks:
        if block.runs and block.language == "python":
            said = io.StringIO()
            with contextlib.redirect_stdout(said):
                exec(compile(block.code, block.place, "exec"), names)
            printed[block.place] = said.getvalue()
        elif block.runs and block.language == "sh" and shell:
            printed[block.place] = typed(block.code, study, block.place)
    return printed


def typed(commands: str, study: StudyCopy, place: str = "") -> str:
    """Run commands in the copy, with the copy's own package, and return what they printed."""
    binaries = shlex.quote(str(Path(sys.executable).parent))
    done = subprocess.run(
        ["bash", "-ec", commands.replace(".venv/bin", binaries)],
        cwd=study.folder, env=study.environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, f"{place}: {commands}\n{done.stdout}{done.stderr}"
    return done.stdout


def pasted(blocks: Sequence[Block], printed: dict[str, str]) -> list[tuple[str, str]]:
    """Return what each block that ran has printed, beside what the page shows of it in a block of text."""
    pairs = zip(blocks, blocks[1:], strict=False)
    return [
        (printed[block.place], shown.code)
        for block, shown in pairs
        if block.place in printed and shown.language == "text"
    ]


def alike(line: str, other: str) -> bool:
    """Tell whether two lines have the same words, and numbers that differ by as little as processors do."""
    shown, printed = INTERVAL.match(line), INTERVAL.match(other)
    if shown and printed:
        same_words = line.split()[0] == other.split()[0] and shown["rest"] == printed["rest"]
        return same_words and _near(shown, printed)
    if NUMBER.sub("#", line).split() != NUMBER.sub("#", other).split():
        return False
    pairs = zip(NUMBER.finditer(line), NUMBER.findall(other), strict=True)
    return all(abs(float(a[0]) - float(b)) <= _tolerance(line[: a.start()], a[0]) for a, b in pairs)


def _near(shown: re.Match[str], printed: re.Match[str]) -> bool:
    """Tell whether two intervals differ by no more than two samples of one posterior do."""
    width = math.log(float(shown["upper"]) / float(shown["lower"]))
    return all(
        abs(math.log(float(printed[end]) / float(shown[end]))) <= OF_INTERVAL * width
        for end in ("median", "lower", "upper")
    )


def _tolerance(before: str, number: str) -> float:
    """Return by how much a number may differ after these words."""
    if before.rstrip().endswith("k-hat"):
        return OF_K_HAT
    share = OF_EFFICIENCY if before.rstrip().endswith("efficiency") else OF_PROCESSORS
    digits, _, power = number.partition("e")
    last_digit = 10.0 ** (int(power or 0) - len(digits.partition(".")[2]))
    return float(last_digit + share * abs(float(number)))
