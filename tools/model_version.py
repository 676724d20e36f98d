"""The version of the model: which physics, prior and noise a stored number was made under.

Numbers of long runs are stored in docs/tables, beside a version. The fingerprint is what a version gives:
prior draws, recordings made of them and log-likelihoods at fixed parameters. Names and paths do not move it.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from swesbi.artefacts.atomic import atomic_path
from swesbi.artefacts.csv import read_csv, write_csv
from swesbi.config.read import read_merged
from swesbi.config.study import Study, load_study
from swesbi.config.view import View
from swesbi.population.recordings import (
    MODEL_NOISE,
    SAMPLE_BY_SAMPLE,
    STREAMS,
    FreshSettings,
    fresh_subject,
    record_fresh,
    recorded,
)
from swesbi.prior import quantile

MODEL_VERSION: Final = 4
"""Raised whenever the fingerprint moves; tables of an older version are made again."""
TOLERANCE: Final = 1e-6  # relative; processors differ by far less
STORED: Final = Path("docs/tables")
FINGERPRINT: Final = "model_version.json"
VERSIONS: Final = "model_versions.csv"
RENEW: Final = "`python -m tools.model_version`"
SEED: Final = 1
HEARTS: Final = 3
LEVELS: Final = (0.5, 0.3, 0.8)
"""Of the prior's marginal distributions: the fixed parameters."""


class ModelVersionError(ValueError):
    """The fingerprint and the version do not belong together; the message says what to do."""


def fingerprint(study: Study) -> dict[str, float]:
    """Return what the model gives: a number by name, of three hearts of each population."""
    values: dict[str, float] = {}
    for experiment in study.config.population_experiments:
        fresh = FreshSettings.from_plain(View(study, {"experiment": experiment})["fresh"])
        for index in range(HEARTS):
            values |= _of_heart(f"{experiment}/{index}", index, fresh)
    return values


def _of_heart(name: str, index: int, fresh: FreshSettings) -> dict[str, float]:
    subject = fresh_subject(index, fresh, SEED, "fingerprint")
    prior = fresh.model.prior
    fixed = quantile(np.outer(LEVELS, np.ones(len(prior.parameters))), prior)
    values: dict[str, float] = {}
    for kind in (MODEL_NOISE, SAMPLE_BY_SAMPLE):
        made = record_fresh(subject, kind, fresh, SEED, "fingerprint", STREAMS[kind])
        if not made.recordings:
            continue
        model = recorded(subject, made)
        found = {
            "prior_draw": made.phi[0],
            "speed_m_s": model.recording.speed_m_s,
            "relative_se": model.recording.relative_se,
            "log_likelihood": model.log_likelihood(fixed),
        }
        values |= {
            f"{name}/{kind}/{what}/{number}": float(value)
            for what, row in found.items()
            for number, value in enumerate(row)
        }
    return values


def moved(stored: Mapping[str, float], found: Mapping[str, float]) -> list[str]:
    """Return the names of the numbers that differ by more than the tolerance, or are in one of them alone."""
    return [
        name
        for name in sorted({*stored, *found})
        if not np.isclose(stored.get(name, np.nan), found.get(name, np.nan), rtol=TOLERANCE, atol=TOLERANCE)
    ]


def check_version(folder: Path, found: Mapping[str, float]) -> None:
    """Hold the fingerprint that is stored in a folder against what the model gives."""
    version, stored = _read(folder)
    if names := moved(stored, found):
        raise ModelVersionError(
            f"the model gives other numbers than version {version} ({len(names)} of {len(found)}, first "
            f"{names[0]}). If that is meant, raise MODEL_VERSION, run {RENEW}, and "
            f"make the tables of {folder / VERSIONS} again; if not, find what has changed"
        )
    if version != MODEL_VERSION:
        raise ModelVersionError(
            f"MODEL_VERSION is {MODEL_VERSION}, {folder / FINGERPRINT} is of {version}; run {RENEW}"
        )


def renew(folder: Path, found: Mapping[str, float]) -> None:
    """Store the fingerprint under the version of the code."""
    if (folder / FINGERPRINT).is_file():
        version, stored = _read(folder)
        if version == MODEL_VERSION and moved(stored, found):
            raise ModelVersionError(f"the model has moved since version {version}; raise MODEL_VERSION first")
    with atomic_path(folder / FINGERPRINT) as path:
        path.write_text(json.dumps({"version": MODEL_VERSION, "values": dict(found)}, indent=1) + "\n")


def _read(folder: Path) -> tuple[int, dict[str, float]]:
    stored = json.loads((folder / FINGERPRINT).read_text())
    return stored["version"], stored["values"]


def store_tables(folder: Path, tables: Sequence[Path]) -> None:
    """Copy ``results/<experiment>/<name>.csv`` as <experiment>_<name>, and note the version of the model."""
    stored = {f"{table.parent.name}_{table.stem}": table for table in tables}
    for name, table in stored.items():
        shutil.copyfile(table, folder / f"{name}.csv")
    note_versions(folder, stored)


def note_versions(folder: Path, names: Iterable[str]) -> None:
    """Note the version of the model for tables that it has just made; those no longer there are forgotten.

    Names are paths within the folder, without suffix.
    """
    known = read_versions(folder) | dict.fromkeys(names, MODEL_VERSION)
    rows = sorted((name, version) for name, version in known.items() if (folder / f"{name}.csv").is_file())
    write_csv(folder / VERSIONS, pd.DataFrame(rows, columns=["table", "model_version"]))


def read_versions(folder: Path) -> dict[str, int]:
    """Return the version of the model behind stored tables, by name; of others none is known."""
    index = folder / VERSIONS
    if not index.is_file():
        return {}
    table = read_csv(index)
    return dict(zip(table["table"].tolist(), table["model_version"].tolist(), strict=True))


def main(arguments: Sequence[str]) -> int:
    """Renew the fingerprint, or store tables with the version; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.model_version",
        description="Renew the stored fingerprint of the model, after MODEL_VERSION was raised. With tables: "
        "store these in docs/tables, with the version of the model that made them.",
    )
    parser.add_argument("tables", nargs="*", type=Path, help="results/<experiment>/<name>.csv")
    parser.add_argument(
        "--note", action="store_true", help="the tables lie where they are stored: note the version there"
    )
    options = parser.parse_args(arguments)
    found = fingerprint(load_study(read_merged(Path("config.yaml"), None)))
    try:
        if options.tables:
            check_version(STORED, found)
            if options.note:
                for table in options.tables:
                    note_versions(table.parent, [table.stem])
            else:
                store_tables(STORED, options.tables)
        else:
            renew(STORED, found)
    except ModelVersionError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
