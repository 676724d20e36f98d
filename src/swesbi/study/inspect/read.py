"""What a file of the study holds, whatever its format: facts, settings, arrays."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd
import xarray as xr
import yaml
from numpy.typing import NDArray

from swesbi.artefacts import ArtefactError, DamagedArtefactError, Provenance, files, read_provenance
from swesbi.artefacts.atomic import typed
from swesbi.artefacts.provenance import SCHEMA_VERSION

ORIGIN: Final = "made by"
SETTINGS: Final = "settings"
FACTS: Final = "says"
KINDS: Final = {
    "observation": "observed stiffness curve of one subject, from its recording",
    "contexts": "contexts of the subjects of a cohort",
    "passive": "passive baseline of one subject",
    "simulations": "simulations from a prior, one shard of one subject",
    "pool": "pooled training set of an experiment on features",
    "speed_pool": "training set of an experiment on measured speeds",
    "population_simulations": "simulations over a population, one shard",
    "population_calibration": "recordings of fresh contexts of a population, inferred",
    "population_null": "well-specified recordings of a population, for the tests of its subjects",
    "posterior": "posterior of one subject in one experiment",
    "exact_posterior": "exact posterior of one subject, the network's beside it",
    "predictive": "prior and posterior predictive checks of one subject",
    "noise": "noise of the measured speeds of a cohort",
    "cohort_posterior": "posterior of a cohort: its population, and each subject within it",
    "sensitivity": "posteriors under one variant of the configuration",
    "calibration_recordings": "recordings of known parameters in one subject's context, inferred",
    "calibration_local": "calibration at one subject's own data",
    "calibration": "recordings of known parameters, and what each sampler made of them",
    "identifiability": "posterior and likelihood-ratio intervals of every subject",
    "misspecification": "whether the model can have made the recordings",
    "change": "two visits of one person, inferred together, and what has changed",
    "change_groups": "what has changed in groups of persons who came twice",
    "plan_bank": "simulated persons of a planned study, answered with an effect and without",
    "exam": "answers to the hearts of one generator of the exam",
    "exam_hearts": "stored hearts of one letter of the exam",
    "cmaes": "CMA-ES reference fit of one subject",
    "estimator": "trained network of an experiment, weights of the best epoch",
    "flow": "trained flow of an experiment on measured speeds",
    "checkpoints": "weights of one training after selected epochs",
}
FILES: Final = {
    "support.json": "verdict on the prior support of one subject",
    "training.csv": "losses of a training by epoch",
    "epochs.csv": "recovery and posteriors by epoch of training",
    "recovery.csv": "recovery of known parameters, the experiment's own observation model",
    "recovery_acquisition.csv": "recovery of known parameters from synthetic recordings",
    "strata.csv": "coverage of credible intervals on fresh contexts, by stratum",
    "agreement.csv": "posteriors by a population's network beside those by the cohort's",
    "cohort.csv": "every subject as a population's network answers or refuses it",
    "change.csv": "ratios of a person's later visit to the earlier, by quantity",
    "changes.csv": "the same of all persons who came twice",
    "changes_groups.csv": "what has changed in groups of them: mean ratios, spreads, differences",
    "plan.csv": "power of a planned study by number of repeats and persons",
    "changes_persons.csv": "ratios of every person alone and within their group",
    "exam.csv": "the exam: coverage by generator and quantity",
    "exam_samplers.csv": "the exam: how the hearts of each generator were answered",
    "exam_former_noise.csv": "the same as exam.csv at the cohort's former noise",
    "exam_former_noise_samplers.csv": "the same as exam_samplers.csv at the cohort's former noise",
    "exam_pressures.csv": "the same as exam.csv, answered from speeds and cuff pressures",
    "exam_pressures_samplers.csv": "the same as exam_samplers.csv, answered from speeds and cuff pressures",
    "readings.csv": "readings of the paper's text beside its numbers",
    "readings_given.csv": "which readings give each printed number",
    "readings_recovery.csv": "recovery under readings of the paper's text, by epoch",
    "readings_verdicts.csv": "acquisition seeds under readings of the paper's text",
    "readings_weights.csv": "CMA-ES under other weights of its loss",
    "cohort_posterior.csv": "what the population of a cohort is like, a row a hyperparameter",
    "cohort_subjects.csv": "every subject alone and within its population",
    "pressures.csv": "what cuff pressures add to each subject's answer",
    "ppc.csv": "table 1: predictive scores of every subject and experiment",
    "features.csv": "checked features of every subject and experiment",
    "posterior.csv": "posterior medians, intervals and correlations",
    "paper_comparison.csv": "every number of the paper beside this study's",
    "acquisition_seeds.csv": "virtual volunteers under other acquisition seeds",
    "acquisition_seeds_medians.csv": "medians over acquisition seeds",
    "configuration.yaml": "every choice of a run, merged configuration",
    "subjects.csv": "the subjects of a cohort",
    "recording.yaml": "how the recordings of a cohort were made",
}
OF_PROVENANCE: Final = tuple(Provenance("").attributes())
UNITS: Final = {
    "_kpa": "kPa",
    "_per_s": "s-1",
    "_percent": "%",
    "_m_s": "m s-1",
    "_ml": "mL",
    "_ms": "ms",
    "_cm": "cm",
    "_m2": "m2",
    "_bpm": "min-1",
    "_years": "year",
}
"""Units by how the name of a column ends."""


@dataclass(frozen=True)
class Array:
    """One array: ``values`` of numbers or text, along named dimensions."""

    name: str
    dims: tuple[str, ...]
    values: NDArray[Any]
    units: str = ""
    meaning: str = ""

    @property
    def is_numeric(self) -> bool:
        """Whether the values are numbers."""
        return self.values.dtype.kind in "biuf"


@dataclass(frozen=True)
class Content:
    """One file.

    Attributes:
        path: The file.
        what: What it is, in a few words.
        sections: What it says, text by key: ``ORIGIN`` (version, code hash, seed, subject), the ``SETTINGS``
            behind it, their nested keys joined by dots, and other ``FACTS``.
        arrays: Its arrays.
        integrity: What its checksum says; empty where the format has none.
    """

    path: Path
    what: str
    sections: Mapping[str, Mapping[str, str]]
    arrays: tuple[Array, ...] = ()
    integrity: str = ""


def flatten(plain: object, key: str = "") -> dict[str, str]:
    """Return nested plain data as text by key: ``{"prior": {"low": 2}}`` becomes ``{"prior.low": "2"}``."""
    return dict(_leaves(plain, key))


def _leaves(plain: object, key: str) -> Iterator[tuple[str, str]]:
    if isinstance(plain, dict):
        for name, value in plain.items():
            yield from _leaves(value, f"{key}.{name}" if key else str(name))
    elif isinstance(plain, list) and any(isinstance(item, dict | list) for item in plain):
        for index, value in enumerate(plain):
            yield from _leaves(value, f"{key}[{index}]")
    elif isinstance(plain, list | tuple):
        yield key, ", ".join(map(str, plain))
    else:
        yield key, str(plain)


def read(path: Path) -> Content:
    """Return what a file holds, once its checksum, if it has one, is known to be right.

    Raises:
        ArtefactError: There is no such file, it cannot be read or it is damaged, or of a format that is
            not described.
    """
    if path.is_dir():
        check = typed("swesbi", "inspect", "--check", path)
        remedy = f"name files in it, or check all its artefacts by: {check}"
        raise ArtefactError(f"{path}: is a folder; {remedy}")
    if not path.is_file():
        raise ArtefactError(f"{path}: no such file")
    if path.suffix not in READERS:
        known = ", ".join(READERS)
        raise ArtefactError(f"{path}: {path.suffix or 'no suffix'} is not among the formats shown: {known}")
    return READERS[path.suffix](path)


def _read_hdf5(path: Path) -> Content:
    checked = _integrity(path, files.hdf5_provenance)
    try:
        files.check_self_contained(path)
        provenance = files.hdf5_provenance(path)
        with xr.open_datatree(path, engine="h5netcdf") as tree:
            arrays = tuple(
                _array(f"{node.path}/{name}".strip("/"), variable)
                for node in tree.subtree
                for name, variable in node.to_dataset(inherit=False).variables.items()
            )
    except files.UNREADABLE as error:
        raise DamagedArtefactError(path, f"cannot be read as a swesbi artefact ({error})") from error
    return _artefact(path, checked, provenance, arrays, {})


def _array(name: str, variable: xr.Variable) -> Array:
    values, attributes = variable.to_numpy(), variable.attrs
    return Array(
        name=name,
        dims=tuple(map(str, variable.dims)),
        values=values if values.dtype.kind in "biuf" else values.astype(str),
        units=str(attributes.get("units", "")),
        meaning=str(attributes.get("long_name", "")),
    )


def _read_weights(path: Path) -> Content:
    """Return a file of weights: its metadata, and every tensor by the names that lead to it."""
    # torch takes seconds to import, and most files need none of it
    from swesbi.networks.files import NOT_PLAIN, plain_provenance, read_content

    checked = _integrity(path, plain_provenance)
    try:
        content = read_content(path)
        metadata = content["metadata"]
        provenance = read_provenance(metadata)
    except NOT_PLAIN as error:
        raise DamagedArtefactError(path, f"cannot be read as a file of weights ({error})") from error
    arrays = tuple(array for name in content if name != "metadata" for array in _tensors(name, content[name]))
    facts = {name: _plain(value) for name, value in metadata.items() if name not in OF_PROVENANCE}
    return _artefact(path, checked, provenance, arrays, flatten(facts))


def _tensors(name: str, value: Any) -> Iterator[Array]:  # noqa: ANN401
    """Yield the tensors of nested dictionaries."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _tensors(f"{name}/{key}", item)
    else:
        yield Array(name, tuple(f"d{axis}" for axis in range(value.ndim)), value.numpy(), "1")


def _plain(value: Any) -> Any:  # noqa: ANN401
    """Return metadata as nested data where it is written as JSON."""
    return json.loads(value) if isinstance(value, str) and value.startswith("{") else value


def _integrity(path: Path, provenance: Callable[[Path], Provenance]) -> str:
    """Return what the checksum of an artefact says; one cut off or changed is refused."""
    if not files.has_checksum(path):
        try:
            version = provenance(path).schema_version
        except files.UNREADABLE:
            version = SCHEMA_VERSION
        if version < SCHEMA_VERSION:
            return f"no checksum (schema version {version}, before checksums); this swesbi does not use it"
    files.check_whole(path, provenance)
    return "checksum right"


def _artefact(
    path: Path, checked: str, provenance: Provenance, arrays: tuple[Array, ...], facts: Mapping[str, str]
) -> Content:
    """Return an artefact with its provenance in words."""
    origin = {
        "subject": provenance.subject or "whole cohort",
        "seed": str(provenance.seed),
        "swesbi": provenance.package_version,
        "code hash": provenance.code_hash or "not recorded",
        "schema version": str(provenance.schema_version),
    }
    what = KINDS.get(provenance.kind, f"artefact of kind {provenance.kind!r}")
    sections = {ORIGIN: origin, SETTINGS: flatten(dict(provenance.settings)), FACTS: facts}
    return Content(path, what, sections, arrays, checked)


def _read_csv(path: Path) -> Content:
    table = _parsed(path, "a table", pd.read_csv)
    arrays = tuple(_column(str(name), column) for name, column in table.items())
    return _file(path, {"rows": str(len(table)), "columns": str(len(arrays))}, arrays)


def _column(name: str, column: pd.Series) -> Array:
    units = next((units for ending, units in UNITS.items() if name.endswith(ending)), "")
    is_number = pd.api.types.is_numeric_dtype(column) or pd.api.types.is_bool_dtype(column)
    values = column.to_numpy() if is_number else np.asarray(column.fillna("")).astype(str)
    return Array(name, ("row",), values, units)


def _read_json(path: Path) -> Content:
    return _file(path, flatten(_parsed(path, "JSON", lambda each: json.loads(each.read_text("utf-8")))))


def _read_yaml(path: Path) -> Content:
    return _file(path, flatten(_parsed(path, "YAML", lambda each: yaml.safe_load(each.read_text("utf-8")))))


def _parsed(path: Path, form: str, parse: Callable[[Path], Any]) -> Any:  # noqa: ANN401
    try:
        return parse(path)
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise ArtefactError(f"{path}: cannot be read as {form} ({error})") from error


def _file(path: Path, facts: Mapping[str, str], arrays: tuple[Array, ...] = ()) -> Content:
    """Return a file that is no artefact, and so says nothing of its origin."""
    return Content(path, FILES.get(path.name, f"{path.suffix[1:]} file"), {FACTS: facts}, arrays)


READERS: Final[Mapping[str, Callable[[Path], Content]]] = {
    ".h5": _read_hdf5,
    ".pt": _read_weights,
    ".csv": _read_csv,
    ".json": _read_json,
    ".yaml": _read_yaml,
}
