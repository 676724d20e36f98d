"""Files of network weights."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from swesbi.artefacts import DamagedArtefactError, Provenance, read_provenance
from swesbi.inspection.artefact import described, integrity
from swesbi.inspection.content import Array, Content, flatten

OF_PROVENANCE: Final = tuple(Provenance("").attributes())


def read_weights(path: Path) -> Content:
    """Return a file of weights: its metadata, and every tensor by the names that lead to it.

    Raises:
        DamagedArtefactError: It was cut off or changed, or holds something other than plain tensors.
    """
    # torch takes seconds to import, and most files need none of it
    from swesbi.inference.torch_files import NOT_PLAIN, plain_provenance, read_content

    checked = integrity(path, plain_provenance)
    try:
        content = read_content(path)
        metadata = content["metadata"]
        provenance = read_provenance(metadata)
    except NOT_PLAIN as error:
        raise DamagedArtefactError(path, f"cannot be read as a file of weights ({error})") from error
    arrays = tuple(array for name in content if name != "metadata" for array in _tensors(name, content[name]))
    own = {name: _plain(value) for name, value in metadata.items() if name not in OF_PROVENANCE}
    return replace(described(path, checked, provenance, arrays), facts=flatten(own))


def _tensors(name: str, value: Any) -> Iterator[Array]:  # noqa: ANN401
    """Yield the tensors of nested dictionaries."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _tensors(f"{name}/{key}", item)
    else:
        yield Array(name, tuple(f"d{axis}" for axis in range(value.ndim)), value.numpy(), "1")


def _plain(value: Any) -> Any:  # noqa: ANN401
    """Return metadata as nested data where it is written as JSON."""
    if isinstance(value, str) and value.startswith("{"):
        return json.loads(value)
    return value
