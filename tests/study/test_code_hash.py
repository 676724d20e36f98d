"""The hash of a stage's code: what counts, what does not, and that every function that runs counts."""

from __future__ import annotations

import ast
import copy
import functools
import logging
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from types import FrameType
from typing import Any

import pytest
from evaluation_study import run_cmaes, run_predictive, write_study
from inference_study import make_inputs, run_all
from rules import PLACES, STAGES, run_rule
from study_copy import ROOT

import swesbi
from swesbi.config.read import read_merged
from swesbi.config.study import load_study
from swesbi.study.code import Packages, Place
from swesbi.study.stage import stage_code

SOURCE = Path(swesbi.__file__).parent
LAW = "from toy.part import law\ndef run(): return law(1)\n"


class Toy:
    """A small package named toy, written anew for every hash."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.write(
            {
                "__init__.py": "",
                "stages/__init__.py": "",
                "part/__init__.py": "from toy.part.science import law\n",
                "part/science.py": "def law(x):\n    return 2 * x\ndef other(x):\n    return x\n",
                "stages/one.py": LAW,
            }
        )

    def write(self, files: Mapping[str, str]) -> None:
        for name, text in files.items():
            path = self.folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)

    def hash(self, name: str = "run", module: str = "toy.stages.one") -> str:
        return Packages(self.folder).hash(module, name)

    def changed_by(self, name: str, old: str, new: str) -> bool:
        """Tell whether an edit changes the hash of the stage; the edit stays."""
        before, path = self.hash(), self.folder / name
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new))
        return self.hash() != before


@pytest.fixture
def toy(tmp_path: Path) -> Toy:
    return Toy(tmp_path / "toy")


def test_what_a_function_names_counts_and_its_neighbours_do_not(toy: Toy) -> None:
    assert toy.changed_by("part/science.py", "2 * x", "3 * x")
    assert not toy.changed_by("part/science.py", "return x", "return -x")


def test_docstrings_comments_and_layout_do_not_count(toy: Toy) -> None:
    text = "def law( x ):\n    '''Doc.'''\n    # why\n    return (2 *\n      x)\n'after'\n"
    assert not toy.changed_by("part/science.py", "def law(x):\n    return 2 * x\n", text)


SETTINGS = "from pydantic import Field\nclass S:\n    x: int = Field(ge=1, description='one')\n"


def test_of_a_field_the_description_does_not_count_and_of_anything_else_all_does(toy: Toy) -> None:
    toy.write({"part/science.py": SETTINGS, "part/__init__.py": ""})
    toy.write({"stages/one.py": "from toy.part.science import S\ndef run(): return S()\n"})
    assert not toy.changed_by("part/science.py", "'one'", "'another, ' 'toy.part'")
    assert toy.changed_by("part/science.py", "ge=1", "ge=2")
    own = SETTINGS.replace("from pydantic import Field", "def Field(**given): return given")
    toy.write({"part/science.py": own})
    assert toy.changed_by("part/science.py", "'one'", "'another'")


# what a stage says, and what another module of the package has, in which a 1 that becomes a 2 counts
FOLLOWED = {
    "constant of a constant": ("from toy.a import X\ndef run(): return X", "Y = 1\nX = [Y]"),
    "constant": ("from toy.a import X\ndef run(): return X", "X = 3 + 1"),
    "unpacked": ("from toy.a import X\ndef run(): return X", "X, Y = 1, 3"),
    "added to": ("from toy.a import X\ndef run(): return X", "X = [3]\nX += [1]"),
    "base": ("from toy.a import B\ndef run(): return B()", "class A:\n  x = 1\nclass B(A): pass"),
    "method": ("from toy.a import A\ndef run(): return A()", "class A:\n  def m(s): return 1"),
    "what a method names": (
        "from toy.a import A\ndef run(): return A()",
        "def f(): return 1\nclass A:\n  def m(s): return f()",
    ),
    "decorator": ("from toy.a import d\n@d\ndef run(): pass", "def d(f): return 1"),
    "default": ("from toy.a import X\ndef run(x=X): pass", "X = 1"),
    "annotation": ("from toy.a import A\ndef run(x: A): pass", "class A:\n  x = 1"),
    "annotation of a variable": ("from toy.a import A\nclass B:\n  x: A\ndef run(): B()", "A = 1"),
    "typing": (
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n  from toy.a import A\ndef run(x: A): pass",
        "class A:\n  x = 1",
    ),
    "lambda": ("from toy.a import f\ndef run(): return lambda x: f(x)", "def f(x): return 1"),
    "comprehension": ("from toy.a import f\ndef run(): return [f(x) for x in y]", "def f(x): return 1"),
    "nested": ("from toy.a import f\ndef run():\n  def g(): f()\n  g()", "def f(): return 1"),
    "under another name": ("from toy.a import f as g\ndef run(): g()", "def f(): return 1"),
    "two imports inside": (
        "def run(x):\n  if x: from toy.a import f as g\n  else: from toy.part import law as g\n  g()",
        "def f(): return 1",
    ),
    "module's attribute": ("from toy import a\ndef run(): a.f()", "def f(): return 1"),
    "dotted module": ("import toy.a\ndef run(): toy.a.f()", "def f(): return 1"),
    "module passed on": ("from toy import a\ndef run(): print(a)", "def f(): return 1"),
    "module searched": ("from toy import a\ndef run(): getattr(a, 'f')()", "def f(): return 1"),
    "module in a text": ("def run(): start('toy.a')", "def f(): return 1"),
    "import for effect inside": ("def run():\n  import toy.a", "def f(): return 1"),
    "effect": ("from toy.a import f\ndef run(): f()", "def f(): pass\nprint(1)"),
    "altered": ("from toy.a import X\ndef run(): X", "X = {}\nX.update(a=1)"),
    "entry": ("from toy.a import X\ndef run(): X", "X = {}\nX['a'] = 1"),
    "conditional": ("from toy.a import X\ndef run(): X", "if y:\n  X = 1\nelse:\n  X = 3"),
    "registered": (
        "from toy.a import ALL\ndef run(): ALL[0]()",
        "ALL = []\ndef note(f): ALL.append(f)\n@note\ndef f(): return 1",
    ),
    "set by a function": ("from toy.a import f\ndef run(): f()", "X = 1\ndef f():\n  global X\n  X += 3"),
    "local name of a comprehension": (
        "from toy.a import f\ndef run(): return [f for f in y], f(3)",
        "def f(x): return 1",
    ),
    "other package": ("from toy.a import f\ndef run(): f()", "from math import log10 as g\ndef f(): g(3)"),
}
NOT_FOLLOWED = {
    "other attribute": ("from toy import a\ndef run(): a.g()", "def g(): pass\ndef f(): return 1"),
    "command": (
        "from toy.a import g\ndef run(): g()",
        "def g(): pass\nif __name__ == '__main__':\n  print(1)",
    ),
}


@pytest.mark.parametrize("case", [*FOLLOWED, *NOT_FOLLOWED])
def test_followed(toy: Toy, case: str) -> None:
    stage, text = (FOLLOWED | NOT_FOLLOWED)[case]
    toy.write({"stages/one.py": f"{stage}\n", "a.py": f"{text}\n"})
    assert toy.changed_by("a.py", "1", "2") == (case in FOLLOWED)


def test_the_effect_of_a_package_counts_for_what_lies_in_it(toy: Toy) -> None:
    toy.write({"part/__init__.py": "from toy.part.science import law\nprint(1)\n"})
    assert toy.changed_by("part/__init__.py", "1", "2")


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        ("from toy.part import *\ndef run(): law(1)", ValueError, "cannot be followed; name what is used"),
        ("from ..part import law\ndef run(): law(1)", ValueError, "cannot be followed; name what is used"),
        ("def run(): exec('1')", ValueError, "cannot be followed; name what is used"),
        ("def run(): return A.__subclasses__()", ValueError, "cannot be followed; name what is used"),
        ("from toy.gone import f\ndef run(): f()", ModuleNotFoundError, r"no module 'toy\.gone'"),
        ("def walk(): return 1", AttributeError, r"toy\.stages\.one defines no 'run'"),
    ],
)
def test_what_cannot_be_followed_is_refused(
    toy: Toy, text: str, error: type[Exception], message: str
) -> None:
    toy.write({"stages/one.py": f"{text}\n"})
    with pytest.raises(error, match=message):
        toy.hash()


def test_where_a_definition_lies_does_not_count(toy: Toy) -> None:
    """Two modules, each with its own constant of one text, become one."""
    parts = ["def law(x): return other(x) + C\n", "def other(x): return C\n"]
    toy.write({"a.py": f"C = 3\nfrom toy.b import other\n{parts[0]}", "b.py": f"C = 3\n{parts[1]}"})
    toy.write({"stages/one.py": "from toy.a import law\ndef run(): return law(1)\n"})
    before = toy.hash()
    toy.write({"c.py": f"{parts[1]}C = 3\n{parts[0]}def run(): return law(1)\n"})
    assert toy.hash(module="toy.c") == before
    toy.write({"b.py": f"C = 4\n{parts[1]}"})
    assert toy.hash() != before


def test_two_definitions_of_one_text_are_not_mistaken_for_each_other(toy: Toy) -> None:
    """Both ``f`` read the same, but the constants that they lead to differ."""
    for name, value in (("a", 1), ("b", 2)):
        toy.write({f"{name}.py": f"C = {value}\ndef g(): return C\ndef f(): return g()\n"})
    toy.write({"stages/one.py": "from toy import a, b\ndef run(): return a.f() - b.f()\n"})
    assert toy.changed_by("stages/one.py", "a.f() - b.f()", "b.f() - a.f()")


def test_a_data_file_counts_for_the_definitions_that_name_it(toy: Toy) -> None:
    toy.write({"part/texts/page.html": "one", "part/texts/other.html": "one"})
    toy.changed_by("part/science.py", "2 * x", '2 * x, "texts/page.html", "texts/absent.html", "science.py"')
    toy.changed_by("part/science.py", "return x", 'return "texts/other.html"')
    assert toy.changed_by("part/texts/page.html", "one", "two")
    assert not toy.changed_by("part/texts/other.html", "one", "two")


PACKAGE = Packages(SOURCE)


def reached(stage: str) -> set[Place]:
    return PACKAGE.followed(*PLACES[stage])


def test_stages_reach_their_science_and_no_other() -> None:
    of_cmaes, of_noise = (
        ("swesbi.checks.cmaes", "run_searches"),
        ("swesbi.recording.noise.cohort", "fit_noise"),
    )
    for place, stage in ((of_cmaes, "cmaes"), (of_noise, "noise")):
        assert [one for one in STAGES if place in reached(one)] == [stage]
    for stage in ("ingest", "passive", "simulate", "predictive", "cmaes", "cohort_figures", "tables"):
        modules = {module for module, _ in reached(stage)}
        assert not any(module.startswith("swesbi.networks.paper.training") for module in modules)
        assert not modules & {"swesbi.study.compare", "swesbi.interface"}
    assert len({stage_code(stage) for stage in STAGES.values()}) == len(STAGES)


def edited_package(module: str, name: str) -> Packages:
    """The package with one more statement in a definition, all other modules being what they were."""
    after, anew = Packages(SOURCE), copy.deepcopy(PACKAGE.source(module))
    anew.bound[name] = [*anew.bound.get(name, []), *ast.parse("edited()").body]
    after.source = lambda each: anew if each == module else PACKAGE.source(each)
    return after


def test_an_edit_in_a_package_changes_the_stages_that_reach_it() -> None:
    of_stages = {stage: reached(stage) for stage in STAGES}
    before = {stage: PACKAGE.hash(*PLACES[stage]) for stage in STAGES}
    places = sorted(place for place in set().union(*of_stages.values()) if place[0].count(".") > 1)
    edited = {module.split(".")[1]: (module, name) for module, name in places}
    assert len(edited) >= 12
    for module, name in edited.values():
        after = edited_package(module, name)
        changed = {stage for stage in STAGES if after.hash(*PLACES[stage]) != before[stage]}
        assert changed == {stage for stage, places in of_stages.items() if (module, name) in places}


@dataclass
class Trace:
    """Functions of the package that ran, by module and first line, but for what runs because of imports.

    Functions that numba compiles are seen where ``NUMBA_DISABLE_JIT`` is set.
    """

    ran: set[tuple[str, int]] = field(default_factory=set)
    imports: int = 0

    def of(self, run: Callable[..., Any]) -> Callable[..., Any]:
        """Return a stage's function that notes what it runs, in this thread and in those that it starts."""

        @functools.wraps(run)
        def traced(*artefacts: object, **settings: object) -> object:
            before = sys.getprofile()
            sys.setprofile(self.note)
            threading.setprofile(self.note)
            try:
                return run(*artefacts, **settings)
            finally:
                sys.setprofile(before)
                threading.setprofile(before)

        return traced

    def note(self, frame: FrameType, event: str, _: object) -> None:
        code = frame.f_code
        if code.co_name == "<module>":
            self.imports += {"call": 1, "return": -1}.get(event, 0)
        elif event == "call" and not self.imports and code.co_filename.startswith(str(SOURCE)):
            parts = Path(code.co_filename).relative_to(SOURCE.parent).with_suffix("").parts
            self.ran.add((".".join(parts).removesuffix(".__init__"), code.co_firstlineno))


def traced_stages(patch: pytest.MonkeyPatch, *stages: str) -> dict[str, Trace]:
    traces = {stage: Trace() for stage in stages}
    for stage, trace in traces.items():
        module, name = PLACES[stage]
        patch.setattr(f"{module}.{name}", trace.of(getattr(import_module(module), name)))
    return traces


def lines_of(places: Iterable[Place]) -> set[tuple[str, int]]:
    """Return the lines of definitions, with their decorators: module and number."""
    tops = [(module, top) for module, name in places for top in PACKAGE.source(module).bound.get(name, [])]
    return {
        (module, line)
        for module, top in tops
        for part in (top, *getattr(top, "decorator_list", []))
        for line in range(part.lineno, (part.end_lineno or 0) + 1)
    }


def assert_followed(traces: Mapping[str, Trace], at_least: int) -> None:
    for stage, trace in traces.items():
        assert len(trace.ran) >= at_least
        assert trace.ran <= lines_of(reached(stage)), stage


@pytest.mark.slow
def test_what_ingestion_and_the_simulator_run_is_followed_where_it_is_not_compiled(tmp_path: Path) -> None:
    """In another process, where numba leaves the equations as they are written."""
    paths = (ROOT / "tests" / "study", ROOT / "tests" / "helpers", SOURCE.parent)
    environment = {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": os.pathsep.join(map(str, paths))}
    code = f"import test_code_hash as t; t.run_by_hand({str(tmp_path)!r})"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, env=os.environ | environment, check=True)


def run_by_hand(folder: str) -> None:
    """Run ingestion and the passive stage, and check what they ran."""
    logging.basicConfig()  # what is logged passes by the stream of commands, which makes no result
    study = load_study(read_merged(ROOT / "config.yaml", ROOT / "tests/smoke.yaml"))
    observation = Path(folder) / "observation.h5"
    with pytest.MonkeyPatch.context() as patch:
        traces = traced_stages(patch, "ingest", "passive")
        table = study.cohort.recording("A")
        run_rule("ingest", study, {"table": table}, {"observation": observation}, subject="A")
        passive = Path(folder) / "passive.h5"
        run_rule("passive", study, {"observation": observation}, {"passive": passive}, subject="A")
    assert any(module == "swesbi.heart.equations" for module, _ in traces["passive"].ran)
    assert_followed(traces, at_least=80)


def test_what_training_and_recovery_run_is_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    traces = traced_stages(monkeypatch, "pool", "train", "posterior", "recovery")
    run_all(make_inputs())
    assert_followed(traces, at_least=40)


def test_what_predictive_checks_and_cmaes_run_is_followed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    traces = traced_stages(monkeypatch, "predictive", "cmaes")
    files = next(iter(write_study(tmp_path).values()))
    run_predictive(files, tmp_path / "predictive.h5")
    run_cmaes(files, tmp_path / "cmaes.h5")
    assert_followed(traces, at_least=40)
