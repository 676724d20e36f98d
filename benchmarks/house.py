"""What the layout of the code costs whoever works on it.

    python benchmarks/house.py --part reruns

``reruns``: how many stages an edit makes run again, as the mean over the lines of science: every line of a
definition of the package outside ``stages`` and ``config``.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import swesbi
from swesbi.code_hash import Package, Place
from swesbi.study.registry import STAGES

SOURCE = Path(swesbi.__file__).parent
NO_SCIENCE = ("stages", "config")

Line = tuple[str, int]


def stages_an_edited_line_reruns(folder: Path, entries: Iterable[Place]) -> float:
    """Return the mean over lines of science of the number of stages whose hash an edit of the line changes.

    Args:
        folder: The package.
        entries: The function of each stage.
    """
    package = Package(folder)
    followed = Counter(
        line for entry in entries for line in set(_lines(package, package.followed(entry.module, entry.name)))
    )
    science = {line for module in _science(folder) for line in _lines(package, package.places(module))}
    return sum(followed[line] for line in science) / len(science)


def _lines(package: Package, places: Iterable[Place]) -> Iterable[Line]:
    for place in places:
        for first, last in package.definition(place).lines:
            yield from ((place.module, number) for number in range(first, last + 1))


def _science(folder: Path) -> Iterable[str]:
    for path in sorted(folder.rglob("*.py")):
        parts = path.relative_to(folder.parent).with_suffix("").parts
        if parts[1] not in NO_SCIENCE:
            yield ".".join(parts).removesuffix(".__init__")


def _reruns() -> str:
    entries = [Place(f"swesbi.study.stages.{stage}", "run") for stage in STAGES]
    mean = stages_an_edited_line_reruns(SOURCE, entries)
    return f"stages that an edited line of science reruns: {mean:.1f} of {len(entries)}"


PARTS: Mapping[str, Callable[[], str]] = {"reruns": _reruns}


def main() -> None:
    """Print the parts that are asked for, all by default."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--part", choices=PARTS, action="append")
    for part in parser.parse_args().part or PARTS:
        print(PARTS[part]())


if __name__ == "__main__":
    main()
