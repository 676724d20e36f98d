"""Where an artefact comes from: kind, subject, seed, settings and the code that made it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from swesbi import __version__

SCHEMA_VERSION = 2
"""Raised whenever what a file holds changes: 2 since artefacts end with a checksum.

Files of another version are refused: below 2 nothing shows whether they are whole.
"""


@dataclass(frozen=True)
class Provenance:
    """The root attributes of an artefact; no timestamp, so the same inputs give the same file.

    ``subject`` is empty for what belongs to the whole cohort; ``settings`` are those that the stage used.
    The class of a file names the ``kind``, which is empty until then.
    """

    kind: str
    subject: str = ""
    seed: int = 0
    settings: Mapping[str, Any] = field(default_factory=dict)
    code_hash: str = ""
    package_version: str = __version__
    schema_version: int = SCHEMA_VERSION

    def of(self, kind: str) -> Provenance:
        """Return the same of a file of this kind."""
        return replace(self, kind=kind)

    def attributes(self) -> dict[str, str | int]:
        """Return the attributes as HDF5 stores them: settings as key-sorted JSON."""
        return {
            "kind": self.kind,
            "schema_version": self.schema_version,
            "subject": self.subject,
            "seed": self.seed,
            "settings": json.dumps(dict(self.settings), sort_keys=True),
            "package_version": self.package_version,
            "code_hash": self.code_hash,
        }


def read_provenance(attributes: Mapping[str, Any]) -> Provenance:
    """Rebuild the provenance from an artefact's root attributes.

    Raises:
        KeyError: An attribute is missing, so the file is not an artefact of this package.
    """
    return Provenance(
        kind=str(attributes["kind"]),
        subject=str(attributes["subject"]),
        seed=int(attributes["seed"]),
        settings=json.loads(attributes["settings"]),
        code_hash=str(attributes["code_hash"]),
        package_version=str(attributes["package_version"]),
        schema_version=int(attributes["schema_version"]),
    )
