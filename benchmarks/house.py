"""What the layout of the code costs: its size, what an edit reruns, how long it takes to start.

    python benchmarks/house.py                     # every part, as a table; `make house`
    python benchmarks/house.py --part reruns --part size
    python benchmarks/house.py --configfile tests/smoke.yaml --csv house.csv

Lines of ``src`` belong to one of three concerns. Presentation is the package ``report``. Plumbing is what the
study is run with: ``artefacts``, ``base``, ``config``, ``seeds``, ``study``,
and ``__init__`` and ``__main__`` of the package itself. All else is science.

- ``size``: lines, files, imports, concerns, whole-line comments, long functions and files. A function is
  counted from its ``def`` to its last line, docstring included.
- ``reruns``: how many stages an edit makes run again, as the mean over the lines of definitions: of science
  alone, and of all but stages and configuration.
- ``start``: ``import swesbi.config.study`` in a process of its own, the median of five after one not counted;
  and the dearest ``--help`` of a command over ``import numpy, scipy.stats, pandas``, in turns, medians of 5.
- ``plan``: ``snakemake -n`` with nothing to do, the median of three after one. Needs a finished study in the
  working folder, of ``config.yaml`` or with ``--configfile`` merged over it; says so where there is none.
"""

from __future__ import annotations

import argparse
import ast
import csv
import io
import re
import resource
import statistics
import subprocess
import sys
import time
import tokenize
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

import swesbi
from swesbi.__main__ import COMMANDS
from swesbi.study.code import Packages, Place

SOURCE: Final = Path(swesbi.__file__).parent
RULE: Final = re.compile(r"\*\*stage\(\s*\"([\w.]+):(\w+)\"")
"""The stage that a rule of the study runs."""
PLUMBING: Final = (
    *("artefacts", "base", "config", "seeds", "study"),
    *("__init__", "__main__"),
)
PRESENTATION: Final = ("report",)
SCIENCE: Final = "science"
HEAVY: Final = (
    *("torch", "sbi", "nflows", "zuko", "sklearn", "emcee", "numba", "cma"),
    *("scipy", "pandas", "xarray", "matplotlib", "snakemake"),
)
LIBRARIES: Final = "numpy, scipy.stats, pandas"
LONG_FUNCTION: Final = 60
LONG_FILE: Final = 350
STARTS, PLANS = 5, 3
NOTHING: Final = "Nothing to be done"

Row = tuple[str, str]
Functions = ast.FunctionDef | ast.AsyncFunctionDef


def concern(path: Path, folder: Path = SOURCE) -> str:
    """Return what a file of the package is for: science, presentation or plumbing."""
    top = path.relative_to(folder).with_suffix("").parts[0]
    if top in PLUMBING:
        return "plumbing"
    return "presentation" if top in PRESENTATION else SCIENCE


def import_lines(text: str) -> int:
    """Return how many lines of a file are statements that import."""
    nodes = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Import | ast.ImportFrom)]
    return len({line for node in nodes for line in range(node.lineno, _last(node) + 1)})


def comment_lines(text: str) -> int:
    """Return how many lines of a file hold a comment and nothing else."""
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return sum(token.type == tokenize.COMMENT and token.line.lstrip().startswith("#") for token in tokens)


def function_lengths(text: str) -> list[int]:
    """Return the lines of every function of a file, methods and inner functions included."""
    nodes = [node for node in ast.walk(ast.parse(text)) if isinstance(node, Functions)]
    return [_last(node) - node.lineno + 1 for node in nodes]


def _last(node: ast.stmt) -> int:
    return node.end_lineno or node.lineno


def stages_an_edited_line_reruns(
    folder: Path, entries: Iterable[Place], counts: Callable[[Path], bool]
) -> float:
    """Return the mean over lines of definitions of the number of stages whose hash an edit changes.

    Args:
        folder: The package.
        entries: The function of each stage.
        counts: Whether the lines of a file count.
    """
    package = Packages(folder)
    followed = Counter(line for entry in entries for line in package.lines(package.followed(*entry)))
    modules = [_module(path, folder) for path in sorted(folder.rglob("*.py")) if counts(path)]
    lines = package.lines((module, name) for module in modules for name in package.source(module).bound)
    return sum(followed[line] for line in lines) / len(lines)


def _module(path: Path, folder: Path) -> str:
    return ".".join(path.relative_to(folder.parent).with_suffix("").parts).removesuffix(".__init__")


def timed(command: Sequence[str]) -> tuple[float, float, str]:
    """Run a command and return its processor time and wall time in seconds, and what it said.

    Raises:
        CalledProcessError: It failed.
    """
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    run = subprocess.run(command, check=True, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return processor, wall, run.stdout


def _seconds(runs: Sequence[tuple[float, float, str]]) -> str:
    processor, wall, _ = zip(*runs, strict=True)
    return f"{statistics.median(processor):.2f} / {statistics.median(wall):.2f}"


def _size(_: argparse.Namespace) -> Iterator[Row]:
    texts = {path: path.read_text(encoding="utf-8") for path in sorted(SOURCE.rglob("*.py"))}
    lengths = {path: len(text.splitlines()) for path, text in texts.items()}
    lines = sum(lengths.values())
    yield "lines of src / files / mean", f"{lines:,} / {len(texts)} / {lines / len(texts):.0f}"
    yield "imports, % of lines", f"{100.0 * sum(map(import_lines, texts.values())) / lines:.1f}"
    concerns: Counter[str] = Counter()
    for path, length in lengths.items():
        concerns[concern(path)] += length
    shown = (SCIENCE, "presentation", "plumbing")
    yield "lines of " + " / ".join(shown), " / ".join(f"{concerns[name]:,}" for name in shown)
    yield "whole-line comments, %", f"{100.0 * sum(map(comment_lines, texts.values())) / lines:.1f}"
    functions = [length for text in texts.values() for length in function_lengths(text)]
    long = sum(length > LONG_FUNCTION for length in functions)
    yield f"functions over {LONG_FUNCTION} lines / longest", f"{long} / {max(functions)}"
    yield (
        f"files over {LONG_FILE} lines / longest",
        f"{sum(length > LONG_FILE for length in lengths.values())} / {max(lengths.values())}",
    )


def _reruns(_: argparse.Namespace) -> Iterator[Row]:
    rules = sorted((SOURCE.parents[1] / "workflow" / "rules").glob("*.smk"))
    entries = [place for file in rules for place in RULE.findall(file.read_text(encoding="utf-8"))]
    label = f"stages of {len(entries)} that an edited line reruns"
    for of, counts in (("of science", _is_science), ("outside config", _is_no_setting)):
        yield f"{label}, {of}", f"{stages_an_edited_line_reruns(SOURCE, entries, counts):.1f}"


def _is_science(path: Path) -> bool:
    return concern(path) == SCIENCE


def _is_no_setting(path: Path) -> bool:
    return "config" not in path.relative_to(SOURCE).parts


def _start(_: argparse.Namespace) -> Iterator[Row]:
    listed = f"import sys, swesbi.config.study; print(*[name for name in {HEAVY} if name in sys.modules])"
    runs = [timed([sys.executable, "-c", listed]) for _ in range(STARTS + 1)][1:]
    yield "import swesbi.config.study, s of processor / wall", _seconds(runs)
    yield "heavy libraries that it brings", runs[0][2].strip() or "none"
    ratios = {name: statistics.median(_of_help(name) for _ in range(STARTS)) for name in COMMANDS}
    dearest = max(ratios, key=ratios.__getitem__)
    yield f"--help over importing {LIBRARIES}, s of processor", f"{ratios[dearest]:.2f} ({dearest})"


def _of_help(command: str) -> float:
    shown = timed([sys.executable, "-m", "swesbi", command, "--help"])
    return shown[0] / timed([sys.executable, "-c", f"import {LIBRARIES}"])[0]


def _plan(options: argparse.Namespace) -> Iterator[Row]:
    merged = ["--configfile", *options.configfile] if options.configfile else []
    command = [sys.executable, "-m", "snakemake", "-n", "--cores", "1", *merged]
    label = "snakemake -n with nothing to do, s of processor / wall"
    if NOTHING not in timed(command)[2]:
        yield label, "skipped: no finished study here"
        return
    yield label, _seconds([timed(command) for _ in range(PLANS)])


PARTS: Final[Mapping[str, Callable[[argparse.Namespace], Iterator[Row]]]] = {
    "size": _size,
    "reruns": _reruns,
    "start": _start,
    "plan": _plan,
}


def main() -> None:
    """Print the parts that are asked for, all by default."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--part", choices=PARTS, action="append", help="all by default")
    parser.add_argument("--configfile", nargs="+", help="merged over config.yaml in that study")
    parser.add_argument("--csv", type=Path, help="where to write the table as well")
    options = parser.parse_args()
    rows = [row for part in options.part or PARTS for row in PARTS[part](options)]
    width = max(len(name) for name, _ in rows)
    print("\n".join(f"{name:<{width}}  {value}" for name, value in rows))
    if options.csv:
        with options.csv.open("w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows([("measure", "value"), *rows])


if __name__ == "__main__":
    main()
