"""Puts configuration and shipped cohort into the package of a wheel; a checkout has them beside it."""

from __future__ import annotations

import shutil
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

ROOT = Path(__file__).parent
SHIPPED = (
    "config.yaml",
    "config/*.yaml",
    "data/virtual_volunteers/*.[cy]*",
    "data/virtual_volunteers/swe/*.csv",
)


class BuildWithShipped(build_py):
    """Builds the package, and copies what commands need where there is no checkout."""

    def run(self) -> None:
        """Build."""
        super().run()
        shipped = Path(self.build_lib) / "swesbi" / "shipped"
        for pattern in SHIPPED:
            for path in sorted(ROOT.glob(pattern)):
                target = shipped / path.relative_to(ROOT)
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, target)


setup(cmdclass={"build_py": BuildWithShipped})
