"""The programs in ``data`` that made the shipped recordings."""

from __future__ import annotations

import sys
from types import ModuleType

from study_copy import ROOT


def maker(cohort: str) -> ModuleType:
    """Return ``make.py`` of a shipped cohort as a module; nothing is written beside it."""
    path = ROOT / "data" / cohort / "make.py"
    module = ModuleType(f"make_{cohort}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module  # where dataclasses look up their annotations
    exec(compile(path.read_text(encoding="utf-8"), str(path), "exec"), module.__dict__)
    return module


def shipped_files(cohort: str) -> list[str]:
    """Return the files of a shipped cohort that its program writes, relative to its folder."""
    folder = ROOT / "data" / cohort
    paths = (path for path in folder.rglob("*") if path.is_file() and path.suffix not in {".py", ".pyc"})
    return sorted(path.relative_to(folder).as_posix() for path in paths)
