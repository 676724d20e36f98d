"""Summarise files of the study, compare two runs of it, or verify checksums."""

from __future__ import annotations

import argparse
import filecmp
import hashlib
import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from swesbi.artefacts import Array, ArtefactError, DamagedArtefactError
from swesbi.artefacts.atomic import typed
from swesbi.artefacts.files import check_json, check_whole
from swesbi.artefacts.schema import NUMERIC
from swesbi.base.ending import EXIT_REFUSED
from swesbi.study.contents import FACTS, ORIGIN, READERS, SETTINGS, VERDICTS, Content, read
from swesbi.study.job import options_of
from swesbi.study.parsers import ARTEFACTS

FIRST: Final = "only in the first"
SECOND: Final = "only in the second"
DAMAGED: Final = "damaged, so not compared"
ARRAYS: Final = "arrays"
OTHER: Final = "other files whose bytes differ"
TITLES: Final = (FIRST, SECOND, DAMAGED, SETTINGS, ORIGIN, VERDICTS, FACTS, ARRAYS, OTHER)
OF_RESULTS: Final = ("logs", "cohort")
"""Folders beside each other in the results of every study."""
NO_RESULTS: Final = ("logs", "snakemake-report.html")
"""What differs from run to run beside the results: timings and dates."""


def main(given: argparse.Namespace) -> int:
    """Run `inspect`; return 0, or 1 if the runs differ, or 2 if a file is missing, damaged or unreadable."""
    if given.diff:
        differences = compare_runs(*given.diff)
        lines = [line for title, below in differences.items() for line in (f"{title}:", *below)]
        print("\n".join([*lines, "the runs differ" if lines else "the runs are equal"]))
        return EXIT_REFUSED if DAMAGED in differences else int(bool(lines))
    status = 0
    for path in _artefacts_in(given.files) if given.check else given.files:
        try:
            if given.check:
                (check_json if path.suffix == ".json" else check_whole)(path)
            print(f"{path}: whole" if given.check else summary(path))
        except ArtefactError as error:
            print(f"swesbi: {advised(error)}", file=sys.stderr)
            status = EXIT_REFUSED
    return status


def summary(path: Path) -> str:
    """Return what a file is, what made it, and of each array path, dimensions, units and meaning."""
    sections, arrays = read(path)
    if settings := sections.pop(SETTINGS, {}):
        digest = hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()
        sections[ORIGIN]["settings hash"] = digest[:16]
    lines = [f"{key}: {value}" for section in sections.values() for key, value in section.items()]
    for name, array in arrays.items():
        dimensions = " x ".join(f"{dim} {size}" for dim, size in array.sizes.items()) or "scalar"
        parts = (name, dimensions, array.attrs.get("units"), array.attrs.get("long_name"))
        lines.append("  ".join(filter(None, parts)))
    return "\n  ".join([str(path), *lines])


def _artefacts_in(paths: Sequence[Path]) -> Iterator[Path]:
    """Yield the files given, and the artefacts in the folders given, each of which must have one."""
    for path in paths:
        inside = sorted(path.rglob("*")) if path.is_dir() else [path]
        if not (artefacts := [each for each in inside if each.suffix in ARTEFACTS]):
            raise ArtefactError(f"{path}: no artefact ({', '.join(ARTEFACTS)})")
        yield from artefacts


def advised(error: Exception) -> str:
    """Return what is wrong with a file, and the command that makes it again where one is known."""
    if not isinstance(error, DamagedArtefactError):
        return str(error)
    # they take seconds to import, and a file that is whole needs none of it
    from swesbi.answers.files import OBSERVATION
    from swesbi.study.compare import CHANGES

    path, again = error.path.absolute(), ""
    above = (each for each in path.parents if all((each / name).is_dir() for name in OF_RESULTS))
    if results := next(above, None):
        _, *inside = path.relative_to(results).parts
        if inside[:1] != [CHANGES]:
            return error.message(options_of(results / "logs"))
        whose = ("--person", inside[1]) if len(inside) > 2 else ("--all",)
        again = typed("swesbi", "compare", "--cohort", "FOLDER", *whose)
    elif (path.parent / OBSERVATION).is_file():
        subject = ("--subject", path.parent.name, "--out", path.parents[1])
        again = typed("swesbi", "infer", "FOLDER", *subject, "--force")
    remedy = f"with FOLDER of the recordings: {again}" if again else "it is no result of a study"
    return f"{error.path}: {error.fault}; {remedy}"


def compare_runs(first: Path, second: Path) -> dict[str, list[str]]:
    """Return what differs between the results of two runs, in lines by title, those of ``TITLES``."""
    one, two = _results_of(first), _results_of(second)
    lines: dict[str, list[str]] = {title: [] for title in TITLES}
    lines[FIRST], lines[SECOND] = sorted(one - two), sorted(two - one)
    differences: dict[tuple[str, str], list[str]] = {}
    for name in sorted(one & two):
        for difference in _differences(first / name, second / name):
            differences.setdefault(difference, []).append(name)
    for (title, text), names in differences.items():
        shown = names[:3] if title in (SETTINGS, ORIGIN) else names
        more = f" and {len(names) - len(shown)} more" if len(names) > len(shown) else ""
        lines[title] += [f"{text}  ({', '.join(shown)}{more})"] if text else names
    return {title: below for title, below in lines.items() if below}


def _results_of(folder: Path) -> set[str]:
    """Return the results in a folder, relative to it."""
    inside = (path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    shown = (path for path in inside if not any(part.startswith(".") for part in path.parts))
    if not (results := {str(path) for path in shown if path.parts[0] not in NO_RESULTS}):
        raise ArtefactError(f"{folder}: has no results; name the results folder of a run")
    return results


def _differences(first: Path, second: Path) -> list[tuple[str, str]]:
    """Return in what two files differ, each with its title; without text where only their bytes do."""
    try:
        if filecmp.cmp(first, second, shallow=False):
            return []
        contents = [read(path) for path in (first, second) if path.suffix in READERS]
        return (list(_changes(*contents)) if contents else []) or [(OTHER, "")]
    except (ArtefactError, OSError) as error:
        return [(DAMAGED, advised(error))]


def _changes(first: Content, second: Content) -> Iterator[tuple[str, str]]:
    (sections, arrays), (other_sections, other_arrays) = first, second
    for title in sections.keys() | other_sections.keys():
        one, two = sections.get(title, {}), other_sections.get(title, {})
        for key in {**one, **two}:
            if one.get(key) != two.get(key):
                yield title, f"{key}: {one.get(key, '(none)')} -> {two.get(key, '(none)')}"
    for name in {**arrays, **other_arrays}:
        if name not in arrays or name not in other_arrays:
            yield ARRAYS, f"{name}: {FIRST if name in arrays else SECOND}"
        elif difference := array_difference(arrays[name], other_arrays[name]):
            yield ARRAYS, f"{name}: {difference}"


def array_difference(one: Array, two: Array) -> str:
    """Return how two arrays of one name differ; empty where they do not.

    The relative difference is |a - b| / max(|a|, |b|), at most 2; missing values equal missing values.
    """
    shapes = [f"{each.sizes} {each.attrs.get('units', '')}".rstrip() for each in (one, two)]
    if shapes[0] != shapes[1]:
        return " against ".join(shapes)
    a, b = one.to_numpy(), two.to_numpy()
    if a.dtype.kind not in NUMERIC or b.dtype.kind not in NUMERIC:
        differing = int((a.astype(str) != b.astype(str)).sum())
        return f"{differing} texts differ" if differing else ""
    a, b = a.astype(np.float64), b.astype(np.float64)
    different = (a != b) & ~(np.isnan(a) & np.isnan(b))
    if not different.any():
        return ""
    if missing := int((np.isfinite(a) != np.isfinite(b)).sum()):
        return f"{missing} values are missing in one alone"
    gap = np.abs(a - b)[different]
    relative = gap / np.maximum(np.abs(a), np.abs(b))[different]
    largest = f"{gap.max():.3g} {one.attrs.get('units', '')}".rstrip()
    return f"max abs {largest}, max rel {relative.max():.3g}"
