"""HDF5 artefacts: named, dimensioned arrays with units and provenance, written whole or not at all."""

from swesbi.artefacts.atomic import atomic_path
from swesbi.artefacts.build import build_dataset
from swesbi.artefacts.errors import ArtefactError, DamagedArtefactError
from swesbi.artefacts.files import load, save, write_json
from swesbi.artefacts.provenance import Provenance, read_provenance

__all__ = [
    "ArtefactError",
    "DamagedArtefactError",
    "Provenance",
    "atomic_path",
    "build_dataset",
    "load",
    "read_provenance",
    "save",
    "write_json",
]
