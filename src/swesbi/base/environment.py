"""An environment of Python: whether it was copied with its folder, and what its installation lacks."""

from __future__ import annotations

import os
import re
import shlex
import sys
from pathlib import Path
from typing import Final

STUDY: Final = ("cma", "nflows", "sbi", "snakemake", "torch", "zuko")
"""Modules that the extra `study` brings, as pyproject.toml lists them."""
RUNNING: Final = Path(__file__).parents[1]
"""The package that runs."""
MADE_FOR: Final = re.compile(rb"""[!"](/[^\n]*)/bin/python""")
"""In the first lines of a program: the environment that it was installed into."""


def of_another_folder() -> str:
    """Return how to renew an environment that was copied beside other code than it runs; else ''.

    It is that of the interpreter, or of the program that was typed, which names the interpreter that it was
    installed with. Code that was asked for stays: by PYTHONPATH, or by the folder from which one starts.
    """
    asked = [Path(), *map(Path, filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep)))]
    if any(folder.absolute() == RUNNING.parent for folder in asked):
        return ""
    for environment in (Path(sys.prefix), Path(sys.argv[0]).absolute().parent.parent):
        beside, made_for = environment.parent / "src" / "swesbi", _made_for(environment)
        if (
            (beside / "__init__.py").is_file()
            and not beside.samefile(RUNNING)
            and not RUNNING.is_relative_to(environment)
            and not (made_for.exists() and made_for.samefile(environment))
        ):
            return (
                f"{environment} was made for another folder: it runs the code in {RUNNING}, not that in "
                f"{beside}; make it anew: cd {shlex.quote(str(environment.parent))} && "
                f"rm -r {shlex.quote(environment.name)} && make install"
            )
    return ""


def _made_for(environment: Path) -> Path:
    """Return the environment that one was made as: itself, unless its programs say otherwise."""
    program = environment / "bin" / "swesbi"
    found = MADE_FOR.search(program.read_bytes()[:1000]) if program.is_file() else None
    return Path(os.fsdecode(found[1])) if found else environment


def missing(error: ModuleNotFoundError) -> ModuleNotFoundError:
    """Return the error that names the extra, where this is what the missing module comes with."""
    module = (error.name or "").partition(".")[0]
    if module not in STUDY:
        return error
    return ModuleNotFoundError(
        f"{module} is not installed; it comes with the extra `study`: pip install 'swesbi[study]', or "
        "`make install` in a checkout",
        name=module,
    )
