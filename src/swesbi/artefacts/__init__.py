"""HDF5 artefacts: named, dimensioned arrays with units and provenance, written whole or not at all."""

from swesbi.artefacts.artefact import Artefact
from swesbi.artefacts.atomic import (
    ArtefactError,
    DamagedArtefactError,
    UnfitError,
    atomic_path,
    folder_made_whole,
)
from swesbi.artefacts.files import load, save, write_json
from swesbi.artefacts.provenance import Origin, Provenance, read_provenance
from swesbi.artefacts.schema import Labels, Part, Variable, arranged, build_dataset, register
from swesbi.artefacts.stored import (
    from_dataset,
    from_groups,
    from_rows,
    labels_of,
    schema_of,
    stacked_values,
    to_dataset,
    to_groups,
    values_of,
)

__all__ = [
    "Artefact",
    "ArtefactError",
    "DamagedArtefactError",
    "Labels",
    "Origin",
    "Part",
    "Provenance",
    "UnfitError",
    "Variable",
    "arranged",
    "atomic_path",
    "build_dataset",
    "folder_made_whole",
    "from_dataset",
    "from_groups",
    "from_rows",
    "labels_of",
    "load",
    "read_provenance",
    "register",
    "save",
    "schema_of",
    "stacked_values",
    "to_dataset",
    "to_groups",
    "values_of",
    "write_json",
]
