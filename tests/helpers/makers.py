"""The programs in ``data`` that made the shipped recordings."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType

import matplotlib.image
import numpy as np
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


def check_made_again(cohort: str, made: Path) -> None:
    """Compare what a program wrote with what is shipped: every byte, and of pictures the colours."""
    names = sorted(path.relative_to(made).as_posix() for path in made.rglob("*") if path.is_file())
    assert names == shipped_files(cohort)
    for name in names:
        paths = (made / name, ROOT / "data" / cohort / name)
        if name.endswith(".png"):
            np.testing.assert_allclose(*map(matplotlib.image.imread, paths), atol=0.02)
        else:
            one, other = (path.read_bytes() for path in paths)
            assert one == other, name
