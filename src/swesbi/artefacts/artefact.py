"""A dataclass that is an HDF5 file: written and read by the marks on its fields."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, Self

from swesbi.artefacts.atomic import ArtefactError, DamagedArtefactError, atomic_path
from swesbi.artefacts.files import (
    UNREADABLE,
    Provenance,
    append_checksum,
    check_identity,
    provenance_of,
    read_groups,
)
from swesbi.artefacts.groups import ROOT, Group, as_netcdf
from swesbi.artefacts.schema import (
    Labels,
    Schema,
    check_group,
    from_groups,
    labels_of,
    schema_of,
    to_groups,
)


class Artefact:
    """What a file holds, of the kind that the class names: ``class Fit(Artefact, kind="fit")``.

    A class whose content does not follow its fields one by one has its own ``schema``, ``to_groups`` and
    ``rebuilt``. ``labels`` are label coordinates, by their dimension, that are the same in every file.
    """

    kind: ClassVar[str]
    labels: ClassVar[Mapping[str, Any]] = {}

    def __init_subclass__(cls, kind: str = "", **others: Any) -> None:  # noqa: ANN401
        """Keep the kind; a class without one is of its parent's, or lies in no file of its own."""
        super().__init_subclass__(**others)
        if kind:
            cls.kind = kind

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
        """Return what the files of one input hold together; of most kinds there is one."""
        if len(parts) > 1:
            raise ArtefactError(f"{len(parts)} files of kind {cls.kind!r} are given as one")
        return parts[0]

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a file."""
        return cls.rebuilt(*cls.load(path))

    def write(self, path: Path, made: Provenance) -> None:
        """Write the file, whole or not at all."""
        self.save(path, self.to_groups(), made)

    @classmethod
    def load(cls, path: Path) -> tuple[dict[str, Group], Provenance]:
        """Read the groups that the schema names into memory, with its provenance.

        Nothing of the content is used before its checksum, its structure, its kind and version and the
        dimensions, units, types and labels of its groups are as they should be.
        """
        made = provenance_of(path)
        check_identity(path, cls.kind, made)
        try:
            groups = read_groups(path)
            cls._check(groups)
        except UNREADABLE as error:
            fault = f"does not follow the schema of kind {cls.kind!r} ({error})"
            raise DamagedArtefactError(path, fault) from error
        return {name: groups[name] for name in cls.schema()}, made

    @classmethod
    def save(cls, path: Path, groups: Mapping[str, Group], made: Provenance) -> None:
        """Write groups to a file, atomically, with a checksum at its end; its folder is made if need be.

        The group "/" is the root; ``made`` becomes its attributes.
        """
        try:
            cls._check(groups)
        except ValueError as error:
            raise ArtefactError(f"{path}: {error}") from error
        root = groups.get(ROOT, Group({}))
        whole = {**groups, ROOT: replace(root, attrs={**root.attrs, **made.of(cls.kind).attributes()})}
        content = as_netcdf(whole)
        with atomic_path(path) as temporary:
            temporary.write_bytes(content)
            append_checksum(temporary)

    @classmethod
    def _check(cls, groups: Mapping[str, Group]) -> None:
        """Compare groups with the schema; one that the schema does not name is free."""
        for name, variables in cls.schema().items():
            if name not in groups:
                raise ValueError(f"a {cls.kind!r} artefact needs the group {name!r}")
            check_group(name, groups[name], variables, cls.required_labels())
