"""The files behind the page: links, figures with their size, and what made the artefacts."""

from __future__ import annotations

import os
import platform
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Final

import pandas as pd

from swesbi.artefacts import ArtefactError
from swesbi.artefacts.files import hdf5_provenance
from swesbi.report.table import Link, Table

HERE: Final = "."
WHOLE_COHORT: Final = "whole cohort"
MEANING: Final = {
    HERE: "beside this page.",
    "tables": "every table of the study, as CSV, and table 1 as LaTeX.",
    "figures": "figures of the cohort, as PDF and PNG.",
    "cohort": "noise of the speeds; observed curve with errors and rejected samples; passive baseline.",
    "cmaes": "reference fits by CMA-ES: history of every seed, best fit.",
    "simulations": "simulations from each prior, in shards.",
}
EXPERIMENT_MEANING: Final = (
    "training set, network and losses of the experiment; verdict, posterior, predictive check and figures "
    "of each subject."
)
PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
SIZE_AT = slice(16, 24)
SOFTWARE: Final = (
    "numpy", "scipy", "numba", "torch", "sbi", "cma", "pandas", "h5py", "xarray", "matplotlib",
    "snakemake",
)  # fmt: skip


def relative(path: Path, page: Path) -> str:
    """Return how the page refers to a file."""
    return Path(os.path.relpath(path, page.parent)).as_posix()


def file_groups(paths: Sequence[Path], page: Path) -> tuple[Table, ...]:
    """Group the files by the folder that they lie in, in the order given; one row a subject or kind.

    Examples: ``paper/subjects/A/ppc.png`` is ppc.png of A, ``cmaes/A.h5`` is A.h5 of the whole cohort.
    """
    grouped: dict[str, dict[str, list[Link]]] = {}
    for path in dict.fromkeys(paths):
        href = relative(path, page)
        folder, *within, name = Path(href).parts if "/" in href else (HERE, href)
        row = ", ".join(part for part in within if part != "subjects") or WHOLE_COHORT
        grouped.setdefault(folder, {}).setdefault(row, []).append(Link(name, href))
    return tuple(
        Table(
            f"{folder}/: {MEANING.get(folder, EXPERIMENT_MEANING)}",
            pd.DataFrame({"Of": list(rows), "Files": [tuple(links) for links in rows.values()]}),
        )
        for folder, rows in grouped.items()
    )


@dataclass(frozen=True)
class Figure:
    """One figure: where it lies, its size in pixels, what it says to who cannot see it, and its caption."""

    source: str
    full: str
    width: int
    height: int
    description: str
    caption: str


def figure(png: Path, page: Path, description: str, caption: str, pdf: Path | None = None) -> Figure:
    """Return a figure of the page; a click leads to the PDF, or to the PNG where there is none."""
    with png.open("rb") as file:
        head = file.read(SIZE_AT.stop)
    if not head.startswith(PNG_SIGNATURE) or len(head) < SIZE_AT.stop:
        raise ArtefactError(f"{png}: is not a PNG image; delete it and rerun")
    width, height = struct.unpack(">II", head[SIZE_AT])
    return Figure(relative(png, page), relative(pdf or png, page), width, height, description, caption)


def provenance_table(paths: Sequence[Path]) -> Table:
    """Return seed and code of every kind of HDF5 artefact among these files."""
    found = [hdf5_provenance(path) for path in paths if path.suffix == ".h5"]
    named = {"Seed": "seed", "Code hash": "code_hash", "swesbi": "package_version"}
    rows = [
        {"Artefact": kind, "Files": len(each)}
        | {head: ", ".join(sorted({str(getattr(one, name)) for one in each})) for head, name in named.items()}
        for kind in sorted({one.kind for one in found})
        for each in [[one for one in found if one.kind == kind]]
    ]
    return Table(
        "What made the artefacts.",
        pd.DataFrame(rows),
        note="The code hash names the code of the stage that wrote the file, docstrings and comments left "
        "out.",
    )


def software_table() -> Table:
    """Return the versions of what the results depend on."""
    versions = {"Python": platform.python_version()} | {name: version(name) for name in SOFTWARE}
    frame = pd.DataFrame({"Package": list(versions), "Version": list(versions.values())})
    return Table("Versions of the packages behind this run.", frame)
