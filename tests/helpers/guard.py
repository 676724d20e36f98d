"""Hashes of every array, column and figure of a finished study, compared with those of another version.

    python tests/helpers/guard.py store results-smoke before.csv
    python tests/helpers/guard.py compare before.csv results-smoke

Datasets of HDF5 files, columns of tables and keys of JSON files count one by one, figures and LaTeX tables
whole. How a file was made (its code's hash among it) does not count. Weights of networks count by what is
drawn with them. A version that renames files, datasets, columns or keys, or leaves some out, says so in
`RENAMED` and `LEFT_OUT`. Bytes are the same on one kind of processor only: hashes are no part of the project.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np
import pandas as pd

RENAMED: Final[tuple[tuple[str, str], ...]] = ()
"""Patterns of names ``file::item`` of before, and what they are now; the first that matches counts."""
LEFT_OUT: Final[tuple[str, ...]] = ()
"""Patterns of names of before that are no longer made."""
WHOLE: Final = frozenset({".png", ".pdf", ".tex"})
CHECKSUM: Final = "sha256"
SHOWN: Final = 20


def hashes(results: Path) -> pd.Series:
    """Return the hash of every array, column, key and figure below a folder, by ``file::item``."""
    found = {
        f"{path.relative_to(results)}::{item}": hashlib.sha256(content).hexdigest()
        for path in sorted(results.rglob("*"))
        for item, content in _items(path)
    }
    return pd.Series(found, name="sha256").rename_axis("name")


def _items(path: Path) -> Iterator[tuple[str, bytes]]:
    """Yield the parts of a file that count, by name; none of a file of another kind."""
    if path.suffix in WHOLE:
        yield "", path.read_bytes()
    elif path.suffix == ".csv":
        table = pd.read_csv(path, dtype=str, keep_default_na=False, comment="#")
        for column in table:
            yield str(column), "\n".join(table[column]).encode()
    elif path.suffix == ".json":
        for key, value in json.loads(path.read_text(encoding="utf-8")).items():
            if key != CHECKSUM:
                yield key, json.dumps(value, sort_keys=True).encode()
    elif path.suffix == ".h5":
        with h5py.File(path) as file:
            yield from _datasets(file)


def _datasets(file: h5py.File) -> Iterator[tuple[str, bytes]]:
    names: list[str] = []
    file.visititems(lambda name, one: names.append(name) if isinstance(one, h5py.Dataset) else None)
    for name in sorted(names):
        values: Any = file[name][()]
        array = np.asarray(values)
        if array.dtype.kind == "O":
            array = np.array([str(value) for value in array.ravel().tolist()])
        yield name, f"{array.dtype} {np.shape(values)}".encode() + np.ascontiguousarray(array).tobytes()


def renamed(name: str) -> str | None:
    """Return what a name of before is called now; None where it is left out on purpose."""
    if any(re.fullmatch(pattern, name) for pattern in LEFT_OUT):
        return None
    for pattern, now in RENAMED:
        if re.fullmatch(pattern, name):
            return re.sub(pattern, now, name)
    return name


def differences(before: pd.Series, now: pd.Series) -> dict[str, list[str]]:
    """Return names that are missing, that are new, and whose hashes differ."""
    named = {current: value for name, value in before.items() if (current := renamed(str(name)))}
    return {
        "missing": [name for name in named if name not in now.index],
        "new": [str(name) for name in now.index if name not in named],
        "different": [name for name, value in named.items() if name in now.index and now[name] != value],
    }


def main() -> int:
    """Store, or compare; return 1 where something is missing or differs."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    store = commands.add_parser("store", help="write the hashes of a finished study")
    store.add_argument("results", type=Path)
    store.add_argument("file", type=Path)
    compare = commands.add_parser("compare", help="compare a finished study with stored hashes")
    compare.add_argument("file", type=Path)
    compare.add_argument("results", type=Path)
    options = parser.parse_args()
    now = hashes(options.results)
    if options.command == "store":
        now.to_csv(options.file)
        print(f"{len(now)} hashes of {options.results} in {options.file}")
        return 0
    found = differences(pd.read_csv(options.file, index_col="name")["sha256"], now)
    for title, names in found.items():
        print(f"{len(names)} {title}", *names[:SHOWN], *(["..."] if len(names) > SHOWN else []), sep="\n  ")
    return 1 if found["missing"] or found["different"] else 0


if __name__ == "__main__":
    sys.exit(main())
