"""HDF5 artefacts: named, dimensioned arrays with units and provenance, written whole or not at all."""

from swesbi.artefacts.build import build_dataset
from swesbi.artefacts.files import ArtefactError, atomic_path, load, save, write_json
from swesbi.artefacts.provenance import Provenance, read_provenance

__all__ = [
    "ArtefactError",
    "Provenance",
    "atomic_path",
    "build_dataset",
    "load",
    "read_provenance",
    "save",
    "write_json",
]
