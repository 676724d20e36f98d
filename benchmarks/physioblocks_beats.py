"""Time PhysioBlocks 2.0.1 on its own spherical heart; prints seconds per beat. Needs `physioblocks` alone."""

from __future__ import annotations

import importlib
import pkgutil
import sys
import time
from pathlib import Path
from typing import Any

import physioblocks.library
from physioblocks.configuration import load, unwrap_aliases
from physioblocks.io.aliases import load_aliases
from physioblocks.io.configuration import read_json


def simulation(duration_s: float) -> Any:  # noqa: ANN401  the package is untyped
    """Return its reference simulation (one beat a second, step 1 ms), cut to this duration."""
    for module in pkgutil.walk_packages(physioblocks.library.__path__, "physioblocks.library."):
        importlib.import_module(module.name)
    root = Path(physioblocks.__file__).parent
    load_aliases(str(root / "library" / "aliases"))
    configuration = read_json(str(root / "references" / "spherical_heart_forward_sim.jsonc"))
    configuration["parameters"]["time.duration"] = duration_s
    return load(unwrap_aliases(configuration))


def main() -> None:
    """Run as many beats as the first argument says."""
    beats = int(sys.argv[1])
    heart = simulation(float(beats))
    begin = time.process_time()
    heart.run()
    print(f"seconds_per_beat {(time.process_time() - begin) / beats:.6f}")


if __name__ == "__main__":
    main()
