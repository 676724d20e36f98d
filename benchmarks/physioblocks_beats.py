"""Time PhysioBlocks 2.0.1 on its own spherical heart; prints seconds per beat. Needs `physioblocks` alone."""

from __future__ import annotations

import importlib
import pkgutil
import sys
import time
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import physioblocks.library
from physioblocks.configuration import load, unwrap_aliases
from physioblocks.io.aliases import load_aliases
from physioblocks.io.configuration import read_json


@cache
def load_library() -> Path:
    """Make the program's blocks and aliases known; return the folder that it is installed in."""
    for module in pkgutil.walk_packages(physioblocks.library.__path__, "physioblocks.library."):
        importlib.import_module(module.name)
    root = Path(physioblocks.__file__).parent
    load_aliases(str(root / "library" / "aliases"))
    return root


def configuration(duration_s: float, changes: Mapping[str, object]) -> Any:  # noqa: ANN401  the package is untyped
    """Return its reference simulation (one beat a second, step 1 ms), cut to this duration, as configured."""
    shipped = read_json(str(load_library() / "references" / "spherical_heart_forward_sim.jsonc"))
    shipped["parameters"] |= {**changes, "time.duration": duration_s}
    return unwrap_aliases(shipped)


def main() -> None:
    """Run as many beats as the first argument says."""
    beats = int(sys.argv[1])
    heart = load(configuration(float(beats), {}))
    begin = time.process_time()
    heart.run()
    print(f"seconds_per_beat {(time.process_time() - begin) / beats:.6f}")


if __name__ == "__main__":
    main()
