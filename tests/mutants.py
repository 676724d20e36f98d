"""What the fast tests guard: which of them fail when one line of the package is wrong.

Mutants are faults of one line, picked at random from all that a program can make of the physics and the
statistics. Each is put into a private copy of the project, where the tests of its package run; those that
fail are its killers. ``tests/reference/mutants.csv`` keeps them. Tests may change or go as long as every
mutant that was killed is killed still, by whatever test:

    python tests/mutants.py                                 # all of them, held against the stored table
    python tests/mutants.py verdict                         # those of a package
    python tests/mutants.py --pick 80 --out FILE            # others, where the stored lines have gone

The mutations of ``tests/study/test_mutations.py`` are another thing: edits of a whole finished study, which
the stored tables of its results must notice. Here no study is run, and only tests are asked.
"""

from __future__ import annotations

import argparse
import ast
import copy
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from queue import SimpleQueue
from tempfile import TemporaryDirectory
from typing import Final
from xml.etree import ElementTree

import numpy as np
import pandas as pd

ROOT: Final = Path(__file__).resolve().parents[1]
STORED: Final = Path("tests/reference/mutants.csv")
SOURCE: Final = Path("src/swesbi")
KILLERS: Final = "killed_by"
SEPARATOR: Final = "; "
FAST: Final = "not slow and not exhaustive"
LONGEST_S: Final = 3600.0
"""Of a run without a mutant; one with a mutant may take ``SLOWER`` times as long and ``SPARE_S`` more."""
SLOWER: Final = 4.0
SPARE_S: Final = 120.0
TIMEOUT: Final = "timeout"
NOTHING_RUN: Final = "no test can be run"
TESTS: Final[Mapping[str, str]] = {
    "heart": "heart",
    "recording/noise": "recording/test_noise.py recording/test_noise_stage.py recording/test_sweeps.py "
    "recording/test_folder_noise.py recording/test_neighbours.py recording/test_free.py "
    "virtual/test_virtual_cohort.py",
    "measurement": "measurement",
    "posterior": "posterior",
    "verdict": "verdict",
}
"""What is mutated: the physics and the statistics; and the tests of it, below ``tests``."""
SEED: Final = 55
OTHERS: Final[Mapping[type, type]] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
    ast.And: ast.Or, ast.Or: ast.And, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
}  # fmt: skip
"""What stands in an operator's place by mistake."""


@dataclass(frozen=True)
class Mutant:
    """A fault of one line: a part of it is another.

    ``file`` lies below ``src/swesbi``, ``function`` is its name with that of its class, ``line`` the line as
    it stands, without indentation, ``fault`` the same with the fault.
    """

    file: str
    function: str
    line: str
    fault: str

    @property
    def package(self) -> str:
        """The package of the file, or the part of it that `TESTS` names."""
        return next(name for name in TESTS if self.file.startswith(f"{name}/"))

    @property
    def suite(self) -> tuple[str, ...]:
        """Files or folders of the tests."""
        return tuple(f"tests/{name}" for name in TESTS[self.package].split())

    def __str__(self) -> str:
        return f"{self.file}, {self.function}: {self.line} -> {self.fault}"

    def edited(self, folder: Path) -> str | None:
        """Return the text of the file with the fault; None where the function or the line has gone."""
        file = folder / SOURCE / self.file
        if not file.is_file():
            return None
        text = file.read_text(encoding="utf-8")
        function = next((node for name, node in functions(ast.parse(text)) if name == self.function), None)
        if function is None:
            return None
        lines = text.splitlines(keepends=True)
        places = [
            number
            for number in range(function.lineno - 1, function.end_lineno or 0)
            if lines[number].strip() == self.line
        ]
        if not places:
            return None
        lines[places[0]] = lines[places[0]].replace(self.line, self.fault)
        return "".join(lines)

    @contextmanager
    def applied(self, folder: Path) -> Iterator[None]:
        """Put the fault into a copy of the project, and take it back."""
        file = folder / SOURCE / self.file
        text = file.read_bytes()
        file.write_text(self.edited(folder) or "", encoding="utf-8")
        try:
            yield
        finally:
            file.write_bytes(text)


def functions(tree: ast.Module) -> Iterator[tuple[str, ast.FunctionDef]]:
    """Yield functions and methods with their names, that of the class in front."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            yield node.name, node
        elif isinstance(node, ast.ClassDef):
            for method in node.body:
                if isinstance(method, ast.FunctionDef):
                    yield f"{node.name}.{method.name}", method


def faults(node: ast.AST) -> Iterator[ast.AST]:
    """Yield what a node could be by mistake: another operator, sign, number or condition."""
    made = copy.deepcopy(node)
    match made:
        case ast.Compare(ops=[operator]) if type(operator) in OTHERS:
            made.ops = [OTHERS[type(operator)]()]
        case ast.BinOp(op=operator) | ast.AugAssign(op=operator) | ast.BoolOp(op=operator) if (
            type(operator) in OTHERS
        ):
            made.op = OTHERS[type(operator)]()
        case ast.UnaryOp(op=ast.USub() | ast.Not(), operand=operand):
            made = operand
        case ast.Constant(value=bool(value)):
            made.value = not value
        case ast.Constant(value=int(value) | float(value)):
            made.value = value + 1
        case ast.If(test=test) | ast.IfExp(test=test):
            made, node = ast.UnaryOp(ast.Not(), test), test
        case _:
            return
    yield made


def candidates(root: Path, package: str) -> Iterator[Mutant]:
    """Yield all faults of one line in the bodies of a package's functions."""
    for path in sorted((root / SOURCE / package).rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        lines = text.splitlines()
        for name, function in functions(ast.parse(text)):
            passed_over = {
                id(part) for node in ast.walk(function) if says_nothing(node) for part in ast.walk(node)
            }
            for node in (part for statement in function.body for part in ast.walk(statement)):
                place = node.test if isinstance(node, ast.If | ast.IfExp) else node
                for made in faults(node) if id(node) not in passed_over else ():
                    if isinstance(place, ast.expr | ast.stmt) and place.lineno == place.end_lineno:
                        line = lines[place.lineno - 1].encode()
                        said = ast.unparse(made)
                        said = said if isinstance(made, ast.Constant | ast.AugAssign) else f"({said})"
                        fault = line[: place.col_offset] + said.encode() + line[place.end_col_offset :]
                        before, after = line.decode().strip(), fault.decode().strip()
                        yield Mutant(str(path.relative_to(root / SOURCE)), name, before, after)


def says_nothing(node: ast.AST) -> bool:
    """Return whether a fault in it changes no result: messages of errors, and checks of equal lengths."""
    return isinstance(node, ast.Raise) or (isinstance(node, ast.keyword) and node.arg == "strict")


def picked(root: Path, number: int) -> list[Mutant]:
    """Return as many faults of each package, picked at random, no two of one line."""
    chosen: list[Mutant] = []
    for package in TESTS:
        rng = np.random.default_rng([SEED, *package.encode()])
        found = list(candidates(root, package))
        lines: dict[tuple[str, str], Mutant] = {}
        for place in rng.permutation(len(found)):
            lines.setdefault((found[place].file, found[place].line), found[place])
        chosen += list(lines.values())[: number // len(TESTS)]
    return chosen


@dataclass(frozen=True)
class Run:
    """Tests that failed, by file and name without parameters, and how long all of them took."""

    failed: frozenset[str]
    seconds: float


def copied(root: Path, folder: Path) -> Path:
    """Copy the files of a project that are in its repository, or could be."""
    listing = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(listing, cwd=root, check=True, capture_output=True, text=True).stdout
    for name in filter(None, listed.split("\0")):
        if (root / name).is_file():  # one that was deleted is listed still
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(root / name, folder / name)
    found = started(["-c", "import swesbi; print(swesbi.__file__)"], folder).communicate()[0].strip()
    if Path(found) != folder / SOURCE / "__init__.py":
        raise RuntimeError(f"tests of {folder} would import {found}")
    return folder


def tested(folder: Path, suite: tuple[str, ...], timeout_s: float) -> Run:
    """Run tests of a copy of the project."""
    report, began = folder.with_suffix(".xml"), time.monotonic()
    report.unlink(missing_ok=True)
    options = ["-q", "-p", "no:cacheprovider", "--continue-on-collection-errors", f"--junitxml={report}"]
    process = started(["-m", "pytest", *options, "-m", FAST, *suite], folder)
    try:
        process.communicate(timeout=timeout_s)
        failed = frozenset(failures(report)) if report.exists() else frozenset({NOTHING_RUN})
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        failed = frozenset({TIMEOUT})
    return Run(failed, time.monotonic() - began)


def started(arguments: Sequence[str], folder: Path) -> subprocess.Popen[str]:
    """Start Python in a copy, whose sources come before the installed ones.

    Byte code is not kept, since it is told by size and second of the source. Compiled kernels are, beside
    the copy: they are told by what all sources of the heart say.
    """
    own = {"PYTHONPATH": str(folder / "src"), "NUMBA_CACHE_DIR": str(folder.with_suffix(".numba"))}
    return subprocess.Popen(
        [sys.executable, *arguments],
        cwd=folder,
        env={**os.environ, **own, "PYTHONDONTWRITEBYTECODE": "1", "OMP_NUM_THREADS": "1"},
        text=True,
        start_new_session=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )


def failures(report: Path) -> Iterator[str]:
    """Yield the tests of a report of pytest that failed, or the file that cannot be read."""
    for case in ElementTree.parse(report).iter("testcase"):
        if case.find("failure") is not None or case.find("error") is not None:
            module, name = case.get("classname", ""), case.get("name", "").split("[")[0]
            yield f"{module.replace('.', '/')}.py::{name}" if module else f"{name.replace('.', '/')}.py"


def killers(mutants: Sequence[Mutant], root: Path, workers: int) -> Iterator[tuple[Mutant, Run]]:
    """Yield each mutant with the tests that it fails, those left out that fail without it."""
    with TemporaryDirectory(prefix="mutants-") as parent, ThreadPoolExecutor(workers) as pool:
        copies: SimpleQueue[Path] = SimpleQueue()
        for number in range(workers):
            copies.put(copied(root, Path(parent).resolve() / str(number)))

        def run(suite: tuple[str, ...], timeout_s: float, mutant: Mutant | None = None) -> Run:
            folder = copies.get()
            try:
                with nullcontext() if mutant is None else mutant.applied(folder):
                    return tested(folder, suite, timeout_s)
            finally:
                copies.put(folder)

        suites = list(dict.fromkeys(mutant.suite for mutant in mutants))
        intact = dict(zip(suites, pool.map(lambda suite: run(suite, LONGEST_S), suites), strict=True))
        for suite, without in intact.items():
            print(f"{' '.join(suite)}: {without.seconds:.0f} s without a mutant", flush=True)
            if without.failed & {TIMEOUT, NOTHING_RUN}:
                raise RuntimeError(f"{' '.join(suite)}: {', '.join(without.failed)} without a mutant")
            for name in sorted(without.failed):
                print(f"  fails without a mutant, and kills none: {name}", flush=True)

        def mutated(mutant: Mutant) -> Run:
            without = intact[mutant.suite]
            made = run(mutant.suite, SLOWER * without.seconds + SPARE_S, mutant)
            return Run(made.failed - without.failed, made.seconds)

        yield from zip(mutants, pool.map(mutated, mutants), strict=True)


def read_table(path: Path) -> tuple[list[Mutant], list[str]]:
    """Return the mutants of a table, and the tests that killed each, joined; "" of one that lives."""
    table = pd.read_csv(path, keep_default_na=False)
    rows = table[[field.name for field in fields(Mutant)]].itertuples(index=False)
    return [Mutant(*map(str, row)) for row in rows], table[KILLERS].tolist()


def write_table(path: Path, mutants: Sequence[Mutant], killed_by: Sequence[str]) -> None:
    """Write a table of mutants; that it is whole at any time is not needed, since it is made again."""
    table = pd.DataFrame([asdict(mutant) for mutant in mutants]).assign(**{KILLERS: list(killed_by)})
    table.to_csv(path, index=False, lineterminator="\n")


def main() -> int:
    """Run the mutants; return 1 where one lives that the stored table says is killed."""
    parser = argparse.ArgumentParser(description="Run mutants against the tests of their packages.")
    parser.add_argument("packages", nargs="*", metavar="PACKAGE", help=f"of {', '.join(TESTS)}; default: all")
    parser.add_argument(
        "--pick", type=int, metavar="NUMBER", help="pick so many anew, in place of the stored"
    )
    parser.add_argument("--out", type=Path, help="table to write")
    parser.add_argument("--workers", type=int, default=2, help="runs side by side")
    parser.add_argument("--table", type=Path, default=ROOT / STORED, help=f"default: {STORED}")
    parser.add_argument("--root", type=Path, default=ROOT, help="project that is tested; default: this one")
    options = parser.parse_args()
    if options.pick:
        mutants = picked(options.root, options.pick)
        before = [""] * len(mutants)
    else:
        mutants, before = read_table(options.table)
    runs = [m for m in mutants if not options.packages or m.package in options.packages]
    gone = [mutant for mutant in runs if mutant.edited(options.root) is None]
    runs = [mutant for mutant in runs if mutant not in gone]
    killed = dict(zip(mutants, before, strict=True))
    lost = []
    for number, (mutant, run) in enumerate(killers(runs, options.root.resolve(), options.workers), start=1):
        by = f"killed by {len(run.failed)}" if run.failed else "ALIVE"
        print(f"{number}/{len(runs)} {mutant}: {by} ({run.seconds:.0f} s)", flush=True)
        if killed[mutant] and not run.failed:
            lost.append(mutant)
        killed[mutant] = SEPARATOR.join(sorted(run.failed))
        if options.out is not None:  # whoever stops it keeps what there is
            write_table(options.out, mutants, list(killed.values()))
    for mutant in gone:
        print(f"its line has gone: {mutant}")
    for mutant in lost:
        print(f"no test notices any more: {mutant}")
    return 1 if lost else 0


if __name__ == "__main__":
    sys.exit(main())
