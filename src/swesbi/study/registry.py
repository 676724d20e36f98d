"""Every stage of the study: which module holds its function, and what it is for.

A stage is a public function of a module of ``swesbi.study.stages`` that takes ``settings`` and ``origin`` by
name; the first line of its docstring says what it is for. Light: the workflow and the command line read it
before anything heavy is imported, so the modules are parsed alone.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, get_type_hints

from swesbi.study.code import stage_hash

FILES: Final = "files"
"""The argument of a stage, if it has one, that is a dataclass of files."""
_SETTINGS, _ORIGIN = "settings", "origin"
_NO_FILES: Final = (FILES, _SETTINGS, _ORIGIN, "return")
_FOLDER: Final = Path(__file__).parent / "stages"
PHASES: Final = {
    "Recordings": ("cohort",),
    "Simulations and networks": ("simulation", "training", "flow_training", "epochs"),
    "Posteriors and verdicts": ("inference", "exact", "verdict", "answers", "pressures", "cmaes"),
    "Diagnostics": ("calibration", "population", "pushes", "predictive", "identifiability"),
    "Persons and groups": ("cohort_posterior", "change_groups", "plan"),
    "Tables, figures and pages": (
        "tables",
        "report",
        "study_figures",
        "subject_figures",
        "check_figures",
        "cohort_posterior_shown",
        "pressures_shown",
    ),
}
"""Modules of stages by what they are for, in the order in which a study runs."""


def _found() -> dict[str, tuple[str, str]]:
    """Return the module of each stage and the first line of its docstring; no module is imported.

    Raises:
        ValueError: A stage has no docstring, or two have one name.
    """
    stages: dict[str, tuple[str, str]] = {}
    for path in sorted(_FOLDER.glob("*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8"), str(path)).body:
            if isinstance(node, ast.FunctionDef) and _is_stage(node):
                module, name = f"swesbi.study.stages.{path.stem}", node.name
                if not (text := ast.get_docstring(node)):
                    raise ValueError(f"{path}:{node.lineno}: the stage {name} says nothing of itself")
                if name in stages:
                    raise ValueError(f"two stages are named {name}: in {stages[name][0]} and {module}")
                stages[name] = module, text.splitlines()[0]
    return stages


def _is_stage(function: ast.FunctionDef) -> bool:
    """Tell whether a function can be a job: public, with settings and origin by name."""
    named = {argument.arg for argument in function.args.kwonlyargs}
    return not function.name.startswith("_") and {_SETTINGS, _ORIGIN} <= named


_STAGES: Final = MappingProxyType(_found())
STAGES: Final[Mapping[str, str]] = MappingProxyType({name: line for name, (_, line) in _STAGES.items()})
"""What each stage is for."""


def listing() -> str:
    """Return every stage with the first line of its docstring, by phase."""
    width = max(map(len, STAGES)) + 2
    lines = []
    for phase, modules in PHASES.items():
        lines += ["", f"{phase}:"]
        for name, line in STAGES.items():
            if stage_place(name)[0].rpartition(".")[2] in modules:
                lines.append(f"  {name:<{width}}{line}")
    return "\n".join(lines[1:])


def stage_function(name: str) -> Callable[..., None]:
    """Return the function of a stage; its module is imported now, with all that the stage needs.

    Raises:
        As ``stage_place``.
    """
    module, function = stage_place(name)
    run: Callable[..., None] = getattr(import_module(module), function)
    return run


def file_types(run: Callable[..., None]) -> dict[str, Any]:
    """Return the types of a stage's files by name: of its own arguments and of the fields of ``files``."""
    hints = get_type_hints(run)
    group = get_type_hints(hints[FILES]) if FILES in hints else {}
    return {name: hint for name, hint in hints.items() if name not in _NO_FILES} | group


def file_arguments(run: Callable[..., None], files: Mapping[str, Any]) -> dict[str, Any]:
    """Return a stage's files as its arguments: those of the group ``files`` together, if it has one."""
    hints = get_type_hints(run)
    arguments = {name: file for name, file in files.items() if name in hints}
    if FILES in hints:
        arguments[FILES] = hints[FILES](**{name: files[name] for name in get_type_hints(hints[FILES])})
    return arguments


def stage_place(name: str) -> tuple[str, str]:
    """Return the module and the name of the function of a stage.

    A stage of another package is named with its module, ``studies.sensitivity.stages:sensitivity_run``.

    Raises:
        KeyError: The study has no such stage.
    """
    module, _, function = name.rpartition(":")
    return (module, function) if module else (_STAGES[name][0], name)


def job_params(name: str, settings: Mapping[str, Any], seed: int, subject: str = "") -> dict[str, Any]:
    """Return the params of a job that runs a stage: one plain dict, since Snakemake compares params unnamed.

    Raises:
        As ``stage_code``.
    """
    return {
        "code": stage_code(name),
        "name": name,
        "seed": seed,
        "settings": settings,
        "subject": subject,
    }


def stage_code(name: str) -> str:
    """Return the hash of the code that a stage runs.

    Raises:
        As ``stage_place`` and ``Packages.hash``.
    """
    return stage_hash(*stage_place(name))
