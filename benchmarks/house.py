"""What the layout of the code costs: its size, what an edit reruns, how long it takes to start.

    python benchmarks/house.py                     # every part, as a table; `make house`
    python benchmarks/house.py --part reruns --part size

Lines of ``src`` belong to one of three concerns. Presentation is the package ``report``. Plumbing is what the
study is run with: ``artefacts``, ``base``, ``config``, ``seeds``, ``study``,
and ``__init__`` and ``__main__`` of the package itself. All else is science.

- ``size``: lines, files, concerns, long functions and files. A function is counted from its ``def`` to its
  last line, docstring included.
- ``reruns``: how many stages an edit makes run again, as the mean over the lines of definitions: of science
  alone, and of all but stages and configuration.
- ``start``: ``import swesbi.config.study`` in a process of its own, the median of five after one not counted;
  and the dearest ``--help`` of a command over ``import numpy, scipy.stats, pandas``, in turns, medians of 5.
"""

from __future__ import annotations

import argparse
import ast
import re
import statistics
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Final

from processes import run

import swesbi
from swesbi.__main__ import COMMANDS
from swesbi.study.code import Packages, Place

SOURCE: Final = Path(swesbi.__file__).parent
RULE: Final = re.compile(r"\*\*stage\(\s*\"([\w.]+):(\w+)\"")
"""The stage that a rule of the study runs."""
PLUMBING: Final = ("artefacts", "base", "config", "seeds", "study", "__init__", "__main__")
PRESENTATION: Final = ("report",)
SCIENCE: Final = "science"
HEAVY: Final = (
    *("torch", "sbi", "nflows", "zuko", "sklearn", "emcee", "numba", "cma"),
    *("scipy", "pandas", "xarray", "matplotlib", "snakemake"),
)
LIBRARIES: Final = "numpy, scipy.stats, pandas"
LONG_FUNCTION: Final = 60
LONG_FILE: Final = 350
STARTS: Final = 5

Row = tuple[str, str]


def concern(path: Path, folder: Path = SOURCE) -> str:
    """Return what a file of the package is for: science, presentation or plumbing."""
    top = path.relative_to(folder).with_suffix("").parts[0]
    if top in PLUMBING:
        return "plumbing"
    return "presentation" if top in PRESENTATION else SCIENCE


def function_lengths(text: str) -> list[int]:
    """Return the lines of every function of a file, methods and inner functions included."""
    nodes = [n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef)]
    return [(node.end_lineno or node.lineno) - node.lineno + 1 for node in nodes]


def stages_an_edited_line_reruns(
    folder: Path, entries: Iterable[Place], counts: Callable[[Path], bool]
) -> float:
    """Return the mean over lines of definitions of the number of stages whose hash an edit changes.

    ``entries`` are the functions of the stages; ``counts`` says which files' lines count.
    """
    package = Packages(folder)
    followed = Counter(line for entry in entries for line in package.lines(package.followed(*entry)))
    modules = [_module(path, folder) for path in sorted(folder.rglob("*.py")) if counts(path)]
    lines = package.lines((module, name) for module in modules for name in package.source(module).bound)
    return sum(followed[line] for line in lines) / len(lines)


def _module(path: Path, folder: Path) -> str:
    return ".".join(path.relative_to(folder.parent).with_suffix("").parts).removesuffix(".__init__")


def size() -> Iterator[Row]:
    """Yield how large the package is."""
    texts = {path: path.read_text(encoding="utf-8") for path in sorted(SOURCE.rglob("*.py"))}
    lengths = {path: len(text.splitlines()) for path, text in texts.items()}
    lines = sum(lengths.values())
    yield "lines of src / files / mean", f"{lines:,} / {len(texts)} / {lines / len(texts):.0f}"
    concerns: Counter[str] = Counter()
    for path, length in lengths.items():
        concerns[concern(path)] += length
    shown = (SCIENCE, "presentation", "plumbing")
    yield "lines of " + " / ".join(shown), " / ".join(f"{concerns[name]:,}" for name in shown)
    functions = [length for text in texts.values() for length in function_lengths(text)]
    for what, found, most in (
        ("functions", functions, LONG_FUNCTION),
        ("files", [*lengths.values()], LONG_FILE),
    ):
        long = sum(length > most for length in found)
        yield f"{what} over {most} lines / longest", f"{long} / {max(found)}"


def reruns() -> Iterator[Row]:
    """Yield how many stages an edited line reruns."""
    rules = sorted((SOURCE.parents[1] / "workflow" / "rules").glob("*.smk"))
    entries = [place for file in rules for place in RULE.findall(file.read_text(encoding="utf-8"))]
    label = f"stages of {len(entries)} that an edited line reruns"
    for of, counts in (
        ("of science", lambda path: concern(path) == SCIENCE),
        ("outside config", lambda path: "config" not in path.relative_to(SOURCE).parts),
    ):
        yield f"{label}, {of}", f"{stages_an_edited_line_reruns(SOURCE, entries, counts):.1f}"


def start() -> Iterator[Row]:
    """Yield how long the package takes to start."""
    listed = f"import sys, swesbi.config.study; print(*[name for name in {HEAVY} if name in sys.modules])"
    runs = [run([sys.executable, "-c", listed]) for _ in range(STARTS + 1)][1:]
    seconds = (statistics.median(getattr(one, clock) for one in runs) for clock in ("cpu_s", "wall_s"))
    yield "import swesbi.config.study, s of processor / wall", " / ".join(f"{each:.2f}" for each in seconds)
    yield "heavy libraries that it brings", runs[0].output.strip() or "none"
    ratios = {name: statistics.median(_of_help(name) for _ in range(STARTS)) for name in COMMANDS}
    dearest = max(ratios, key=ratios.__getitem__)
    yield f"--help over importing {LIBRARIES}, s of processor", f"{ratios[dearest]:.2f} ({dearest})"


def _of_help(command: str) -> float:
    shown = run([sys.executable, "-m", "swesbi", command, "--help"])
    return shown.cpu_s / run([sys.executable, "-c", f"import {LIBRARIES}"]).cpu_s


PARTS: Final[Mapping[str, Callable[[], Iterator[Row]]]] = {"size": size, "reruns": reruns, "start": start}


def main() -> None:
    """Print the parts that are asked for, all by default."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--part", choices=PARTS, action="append", help="all by default")
    rows = [row for part in parser.parse_args().part or PARTS for row in PARTS[part]()]
    width = max(len(name) for name, _ in rows)
    print("\n".join(f"{name:<{width}}  {value}" for name, value in rows))


if __name__ == "__main__":
    main()
