"""Where the results come from: seed, code, settings, versions; no dates, so that the page stays the same."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Final

import xarray as xr

from swesbi.artefacts.provenance import Provenance, read_provenance
from swesbi.report.table import Row, Table, body, words

SOFTWARE: Final = (
    "numpy",
    "scipy",
    "numba",
    "torch",
    "sbi",
    "cma",
    "pandas",
    "h5py",
    "xarray",
    "arviz",
    "matplotlib",
    "snakemake",
)


def provenance_table(paths: Sequence[Path]) -> Table:
    """Return seed and code of every kind of HDF5 artefact among these files."""
    found: dict[str, list[Provenance]] = {}
    for path in (path for path in paths if path.suffix == ".h5"):
        with xr.open_dataset(path, engine="h5netcdf") as root:
            provenance = read_provenance(root.attrs)
        found.setdefault(provenance.kind, []).append(provenance)
    columns = words("Artefact", "Files", "Seed", "Code hash", "swesbi")
    rows = tuple(_row(kind, each) for kind, each in sorted(found.items()))
    note = "The code hash names the code of the stage that wrote the file, docstrings and comments left out."
    return Table("What made the artefacts.", columns, rows, note)


def _row(kind: str, each: Sequence[Provenance]) -> Row:
    seeds, hashes, versions = (
        ", ".join(sorted({str(getattr(provenance, name)) for provenance in each}))
        for name in ("seed", "code_hash", "package_version")
    )
    return Row((kind, str(len(each)), seeds, hashes, versions))


def software_table() -> Table:
    """Return the versions of what the results depend on."""
    rows = [("Python", platform.python_version()), *((name, version(name)) for name in SOFTWARE)]
    return Table("Versions of the packages behind this run.", words("Package", "Version"), body(rows))
