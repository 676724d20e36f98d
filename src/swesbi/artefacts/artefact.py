"""A dataclass that is an HDF5 file: written and read by the marks on its fields, known by its kind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Self

from swesbi.artefacts.atomic import ArtefactError
from swesbi.artefacts.files import load, save
from swesbi.artefacts.groups import Group
from swesbi.artefacts.provenance import Provenance
from swesbi.artefacts.schema import CLASSES, Labels, Schema
from swesbi.artefacts.stored import from_groups, labels_of, schema_of, to_groups


class Artefact:
    """What a file holds, of the kind that the class names: ``class Fit(Artefact, kind="fit")``.

    A class whose content does not follow its fields one by one has its own ``schema``, ``to_groups``
    and ``rebuilt``.

    Attributes:
        kind: Of the file.
        labels: Label coordinates that are the same in every file, by their dimension.
    """

    kind: ClassVar[str]
    labels: ClassVar[Mapping[str, Any]] = {}

    def __init_subclass__(cls, kind: str = "", **others: Any) -> None:  # noqa: ANN401
        """Make the class known under its kind; a class without one lies in no file of its own."""
        super().__init_subclass__(**others)
        if kind:
            cls.kind = kind
            CLASSES[kind] = cls

    @classmethod
    def schema(cls) -> Schema:
        """Return groups and datasets of the file."""
        return schema_of(cls)

    @classmethod
    def required_labels(cls) -> tuple[Labels, ...]:
        """Return the text labels that the file has wherever it has their dimension."""
        return (*map(Labels, cls.labels), *labels_of(cls))

    def to_groups(self) -> Mapping[str, Group]:
        """Return the content of the file, a dataset a group."""
        return to_groups(self, self.labels)

    @classmethod
    def rebuilt(cls, groups: Mapping[str, Group], made: Provenance) -> Self:
        """Return what the groups of a file hold, whose provenance may say what they do not."""
        return from_groups(cls, groups)

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Return what the files of one input hold together; of most kinds there is one.

        Raises:
            ArtefactError: The files do not belong together.
        """
        if len(parts) > 1:
            raise ArtefactError(f"{len(parts)} files of kind {cls.kind!r} are given as one")
        return parts[0]

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a file.

        Raises:
            ArtefactError: It is missing, or no such artefact.
        """
        found = {group: load(path, cls.kind, group) for group in cls.schema()}
        made = next(iter(found.values()))[1]
        return cls.rebuilt({group: dataset for group, (dataset, _) in found.items()}, made)

    def write(self, path: Path, made: Provenance) -> None:
        """Write the file, whole or not at all.

        Raises:
            ArtefactError: It cannot be written.
        """
        save(path, self.to_groups(), made.of(self.kind))
