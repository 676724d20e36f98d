"""HDF5 artefacts: named, dimensioned arrays with units and provenance, written whole or not at all."""

from swesbi.artefacts.atomic import (
    ArtefactError,
    DamagedArtefactError,
    UnfitError,
    atomic_path,
    folder_made_whole,
)
from swesbi.artefacts.files import Provenance, read_provenance, write_json
from swesbi.artefacts.groups import Array, Group
from swesbi.artefacts.schema import (
    Labels,
    Part,
    Variable,
    arranged,
    build_group,
    from_groups,
    from_rows,
    labels_of,
    schema_of,
    stacked_values,
    to_groups,
    values_of,
)
from swesbi.artefacts.typed import Artefact

__all__ = [
    "Array",
    "Artefact",
    "ArtefactError",
    "DamagedArtefactError",
    "Group",
    "Labels",
    "Part",
    "Provenance",
    "UnfitError",
    "Variable",
    "arranged",
    "atomic_path",
    "build_group",
    "folder_made_whole",
    "from_groups",
    "from_rows",
    "labels_of",
    "read_provenance",
    "schema_of",
    "stacked_values",
    "to_groups",
    "values_of",
    "write_json",
]
