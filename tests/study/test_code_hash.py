"""The hash of a stage's code: what counts, what does not, and that every function that runs counts."""

from __future__ import annotations

import ast
import logging
import os
import shutil
import subprocess
import sys
from collections.abc import Iterable, Mapping
from importlib import import_module
from pathlib import Path

import pytest
from evaluation_study import run_cmaes, run_predictive, write_study
from forward_model_cases import SETTINGS as FORWARD_MODEL
from inference_case import PAPER_PRIOR
from inference_study import make_inputs, run_all
from rules import PLACES, STAGES, run_rule
from study_copy import ROOT
from traced import SOURCE, Trace

from swesbi.artefacts import Provenance
from swesbi.config.read import read_merged
from swesbi.config.study import load_study
from swesbi.context import Context
from swesbi.heart.prior_simulations import shard_of_prior
from swesbi.measurement import baseline
from swesbi.recording.cohort import observed
from swesbi.study.code import Packages, Place
from swesbi.study.source import Source
from swesbi.study.stage import stage_code

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


def test_the_description_of_a_field_does_not_count_and_its_range_does(toy: Toy) -> None:
    toy.write({"part/science.py": SETTINGS, "part/__init__.py": ""})
    toy.write({"stages/one.py": "from toy.part.science import S\ndef run(): return S()\n"})
    assert not toy.changed_by("part/science.py", "'one'", "'another, ' 'toy.part'")
    assert toy.changed_by("part/science.py", "ge=1", "ge=2")


def test_the_description_of_anything_else_counts(toy: Toy) -> None:
    own = SETTINGS.replace("from pydantic import Field", "def Field(**given): return given")
    toy.write({"part/science.py": own, "part/__init__.py": ""})
    toy.write({"stages/one.py": "from toy.part.science import S\ndef run(): return S()\n"})
    assert toy.changed_by("part/science.py", "'one'", "'another'")


def test_functions_of_one_module_have_hashes_of_their_own(toy: Toy) -> None:
    toy.write({"stages/one.py": "def run(): return 1\ndef walk(): return 2\n"})
    walk = toy.hash("walk")
    assert walk != toy.hash("run")
    toy.write({"stages/one.py": "def run(): return 3\ndef walk(): return 2\n"})
    assert toy.hash("walk") == walk


# what a stage says, what another module of the package has, and an edit there that counts
FOLLOWED = {
    "constant": ("from toy.a import X\ndef run(): return X", "X = 1 + 1", "1 + 1", "1 + 2"),
    "constant of a constant": (
        "from toy.a import X\ndef run(): return X",
        "Y = 1\nX = [Y]",
        "Y = 1",
        "Y = 2",
    ),
    "unpacked": ("from toy.a import X\ndef run(): return X", "X, Y = 1, 2", "1, 2", "3, 2"),
    "added to": ("from toy.a import X\ndef run(): return X", "X = [1]\nX += [2]", "[2]", "[3]"),
    "base": ("from toy.a import B\ndef run(): return B()", "class A:\n  x = 1\nclass B(A): pass", "1", "2"),
    "method": ("from toy.a import A\ndef run(): return A()", "class A:\n  def m(s): return 1", "1", "2"),
    "what a method names": (
        "from toy.a import A\ndef run(): return A()",
        "def f(): return 1\nclass A:\n  def m(s): return f()",
        "1",
        "2",
    ),
    "decorator": ("from toy.a import d\n@d\ndef run(): pass", "def d(f): return 1", "1", "2"),
    "default": ("from toy.a import X\ndef run(x=X): pass", "X = 1", "1", "2"),
    "annotation": ("from toy.a import A\ndef run(x: A): pass", "class A:\n  x = 1", "1", "2"),
    "annotation of a variable": ("from toy.a import A\nclass B:\n  x: A\ndef run(): B()", "A = 1", "1", "2"),
    "typing": (
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n  from toy.a import A\ndef run(x: A): pass",
        "class A:\n  x = 1",
        "1",
        "2",
    ),
    "lambda": ("from toy.a import f\ndef run(): return lambda x: f(x)", "def f(x): return 1", "1", "2"),
    "comprehension": (
        "from toy.a import f\ndef run(): return [f(x) for x in y]",
        "def f(x): return 1",
        "1",
        "2",
    ),
    "nested": ("from toy.a import f\ndef run():\n  def g(): f()\n  g()", "def f(): return 1", "1", "2"),
    "under another name": ("from toy.a import f as g\ndef run(): g()", "def f(): return 1", "1", "2"),
    "import inside": ("def run():\n  from toy.a import f\n  f()", "def f(): return 1", "1", "2"),
    "two imports inside": (
        "def run(x):\n  if x: from toy.a import f as g\n  else: from toy.part import law as g\n  g()",
        "def f(): return 1",
        "1",
        "2",
    ),
    "module's attribute": ("from toy import a\ndef run(): a.f()", "def f(): return 1", "1", "2"),
    "dotted module": ("import toy.a\ndef run(): toy.a.f()", "def f(): return 1", "1", "2"),
    "module passed on": ("from toy import a\ndef run(): print(a)", "def f(): return 1", "1", "2"),
    "module searched": ("from toy import a\ndef run(): getattr(a, 'f')()", "def f(): return 1", "1", "2"),
    "module in a text": ("def run(): start('toy.a')", "def f(): return 1", "1", "2"),
    "import for effect inside": ("def run():\n  import toy.a", "def f(): return 1", "1", "2"),
    "effect": ("from toy.a import f\ndef run(): f()", "def f(): pass\nprint(1)", "1", "2"),
    "altered": ("from toy.a import X\ndef run(): X", "X = {}\nX.update(a=1)", "a=1", "a=2"),
    "entry": ("from toy.a import X\ndef run(): X", "X = {}\nX['a'] = 1", "1", "2"),
    "conditional": ("from toy.a import X\ndef run(): X", "if y:\n  X = 1\nelse:\n  X = 2", "1", "3"),
    "registered": (
        "from toy.a import ALL\ndef run(): ALL[0]()",
        "ALL = []\ndef note(f): ALL.append(f)\n@note\ndef f(): return 1",
        "1",
        "2",
    ),
    "set by a function": (
        "from toy.a import f\ndef run(): f()",
        "X = 1\ndef f():\n  global X\n  X += 1",
        "1\ndef",
        "2\ndef",
    ),
    "local name of a comprehension": (
        "from toy.a import f\ndef run(): return [f for f in y], f(1)",
        "def f(x): return 1",
        "return 1",
        "return 2",
    ),
    "other package": (
        "from toy.a import f\ndef run(): f()",
        "from math import sin as g\ndef f(): g(1)",
        "sin",
        "cos",
    ),
}


@pytest.mark.parametrize(("stage", "text", "old", "new"), FOLLOWED.values(), ids=FOLLOWED)
def test_followed(toy: Toy, stage: str, text: str, old: str, new: str) -> None:
    toy.write({"stages/one.py": f"{stage}\n", "a.py": f"{text}\n"})
    assert toy.changed_by("a.py", old, new)


NOT_FOLLOWED = {
    "other attribute": ("from toy import a\ndef run(): a.g()", "def g(): pass\ndef f(): return 1"),
    "command": (
        "from toy.a import g\ndef run(): g()",
        "def g(): pass\nif __name__ == '__main__':\n  print(1)",
    ),
}


@pytest.mark.parametrize(("stage", "text"), NOT_FOLLOWED.values(), ids=NOT_FOLLOWED)
def test_not_followed(toy: Toy, stage: str, text: str) -> None:
    toy.write({"stages/one.py": f"{stage}\n", "a.py": f"{text}\n"})
    assert not toy.changed_by("a.py", "1", "2")


def test_the_effect_of_a_package_counts_for_what_lies_in_it(toy: Toy) -> None:
    toy.write({"part/__init__.py": "from toy.part.science import law\nprint(1)\n"})
    assert toy.changed_by("part/__init__.py", "1", "2")


@pytest.mark.parametrize(
    "text",
    [
        "from toy.part import *\ndef run(): law(1)",
        "from ..part import law\ndef run(): law(1)",
        "def run(): exec('1')",
        "def run(): return A.__subclasses__()",
    ],
)
def test_what_cannot_be_followed_is_refused(toy: Toy, text: str) -> None:
    toy.write({"stages/one.py": f"{text}\n"})
    with pytest.raises(ValueError, match="cannot be followed; name what is used"):
        toy.hash()


def test_unknown_modules_and_names_are_refused(toy: Toy) -> None:
    with pytest.raises(ModuleNotFoundError, match=r"no module 'toy\.stages\.three'"):
        toy.hash(module="toy.stages.three")
    with pytest.raises(AttributeError, match=r"toy\.stages\.one defines no 'walk'"):
        toy.hash("walk")
    toy.write({"stages/one.py": "from toy.gone import f\ndef run(): f()\n"})
    with pytest.raises(ModuleNotFoundError, match=r"no module 'toy\.gone'"):
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


def entry(stage: str) -> Place:
    return PLACES[stage]


def first_function(folder: Path) -> Place:
    """Return the first function of a package that a stage reaches, or its first."""
    reached = {place for stage in STAGES for place in PACKAGE.followed(*entry(stage))}
    places = [place for path in sorted(folder.rglob("*.py")) for place in functions(path)]
    return next((place for place in places if place in reached), places[0])


def functions(path: Path) -> Iterable[Place]:
    module = ".".join(path.relative_to(SOURCE.parent).with_suffix("").parts)
    body = ast.parse(path.read_text()).body
    return [(module, part.name) for part in body if isinstance(part, ast.FunctionDef)]


PACKAGE = Packages(SOURCE)
PACKAGES = sorted(path.parent for path in SOURCE.glob("*/__init__.py"))


@pytest.fixture(scope="module")
def copied(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("source") / "swesbi"
    shutil.copytree(SOURCE, folder, ignore=shutil.ignore_patterns("__pycache__"))
    return folder


@pytest.mark.parametrize("folder", PACKAGES, ids=lambda folder: folder.name)
def test_an_edit_reruns_the_stages_that_reach_it(folder: Path, copied: Path) -> None:
    edited = first_function(folder)
    path = copied.parent.joinpath(*edited[0].split(".")).with_suffix(".py")
    text = path.read_text()
    tree = ast.parse(text)
    function = next(
        part for part in tree.body if isinstance(part, ast.FunctionDef) and part.name == edited[1]
    )
    function.body.append(ast.parse("print('edited')").body[0])
    path.write_text(ast.unparse(tree))
    after = Packages(copied)
    # all other modules are what they were
    anew = Source(edited[0], path)
    after.source = lambda module: anew if module == edited[0] else PACKAGE.source(module)
    changed = {stage for stage in STAGES if after.hash(*entry(stage)) != PACKAGE.hash(*entry(stage))}
    path.write_text(text)
    assert changed == {stage for stage in STAGES if edited in PACKAGE.followed(*entry(stage))}


def test_stages_reach_their_science_and_no_other() -> None:
    reaching = {
        ("swesbi.checks.cmaes", "search"): {
            "cmaes",
        },
        ("swesbi.recording.noise.cohort", "fit_noise"): {"noise"},
    }
    for place, stages in reaching.items():
        assert {stage for stage in STAGES if place in PACKAGE.followed(*entry(stage))} == stages
    for stage in ("ingest", "passive", "simulate", "predictive", "cmaes", "cohort_figures", "tables"):
        modules = {module for module, _ in PACKAGE.followed(*entry(stage))}
        assert not any(module.startswith("swesbi.networks.paper.training") for module in modules)
        assert not modules & {"swesbi.study.compare", "swesbi.interface"}


def test_every_stage_has_a_hash_of_its_own() -> None:
    assert len({stage_code(stage) for stage in STAGES.values()}) == len(STAGES)


def assert_followed(trace: Trace, stage: str, at_least: int) -> None:
    places = PACKAGE.followed(*entry(stage))
    lines = PACKAGE.lines(places)
    assert len(trace.ran) >= at_least
    assert trace.ran <= lines


def by_hand(stage: str, folder: Path) -> None:
    study = load_study(read_merged(ROOT / "config.yaml", ROOT / "tests/smoke.yaml"))
    observation = folder / "observation.h5"
    inputs = {"ingest": {"table": study.cohort.recording("A")}, "passive": {"observation": observation}}
    outputs = {"ingest": {"observation": observation}, "passive": {"passive": folder / "passive.h5"}}
    run_rule(stage, study, inputs[stage], outputs[stage], subject="A")


def test_what_ingestion_runs_is_followed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    trace = Trace()
    monkeypatch.setattr(observed, "observed_curve", trace.of(observed.observed_curve))
    by_hand("ingest", tmp_path)
    assert_followed(trace, "ingest", at_least=80)


@pytest.mark.slow
def test_what_the_simulator_runs_is_followed_where_it_is_not_compiled(tmp_path: Path) -> None:
    """The same in another process, where numba leaves the equations as they are written."""
    paths = os.pathsep.join(
        [str(ROOT / "tests" / "study"), str(ROOT / "tests" / "helpers"), str(SOURCE.parent)]
    )
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": paths}
    code = f"import test_code_hash as t; t.passive_by_hand({str(tmp_path)!r})"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, env=environment, check=True)


def passive_by_hand(folder: str) -> None:
    """Run ingestion and the passive stage, and check what the latter ran."""
    logging.basicConfig()  # what is logged passes by the stream of commands, which makes no result
    by_hand("ingest", Path(folder))
    trace = Trace()
    baseline.calibrated_passive = trace.of(baseline.calibrated_passive)
    by_hand("passive", Path(folder))
    assert any(module == "swesbi.heart.equations" for module, _ in trace.ran)
    assert_followed(trace, "passive", at_least=80)


def test_what_simulation_and_its_settings_run_is_followed(tmp_path: Path) -> None:
    def simulated() -> None:
        row = Context(
            subject="A",
            sex="F",
            age_years=25.0,
            bsa_m2=1.7,
            hr_bpm=60.0,
            lvedv_ml=90.0,
            lvesv_ml=34.0,
            ivsd_cm=0.8,
        )
        made = shard_of_prior(
            context=row, prior=PAPER_PRIOR, forward_model=FORWARD_MODEL, draw_numbers=(0, 3), seed=1
        )
        made.write(tmp_path / "shard.h5", Provenance("", "A", 1))

    trace = Trace()
    trace.of(simulated)()
    assert_followed(trace, "simulate", at_least=40)


def test_what_training_and_recovery_run_is_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    traces = trace_stages(monkeypatch, "pool", "train", "posterior", "recovery")
    run_all(make_inputs())
    for stage, trace in traces.items():
        assert_followed(trace, stage, at_least=40)


def test_what_predictive_checks_and_cmaes_run_is_followed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    traces = trace_stages(monkeypatch, "predictive", "cmaes")
    files = next(iter(write_study(tmp_path).values()))
    run_predictive(files, tmp_path / "predictive.h5")
    run_cmaes(files, tmp_path / "cmaes.h5")
    for stage, trace in traces.items():
        assert_followed(trace, stage, at_least=40)


def trace_stages(monkeypatch: pytest.MonkeyPatch, *stages: str) -> dict[str, Trace]:
    traces = {stage: Trace() for stage in stages}
    for stage, trace in traces.items():
        module, name = PLACES[stage]
        monkeypatch.setattr(f"{module}.{name}", trace.of(getattr(import_module(module), name)))
    return traces
