"""Files read and written as a type says: artefacts, and what a stage takes and returns, by annotations.

A type is a class with ``read`` and ``write`` (every :class:`Artefact`), or ``Annotated[type, format]`` with a
format that has both (:class:`~swesbi.artefacts.csv.Table`); a text is only written. An input may also be a
``Path``, a tuple of such types, one of the mappings below, or ``None`` where no file is given.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import NoneType
from typing import Annotated, Any, ClassVar, Final, Generic, NamedTuple, Self, TypeVar, get_args, get_origin

from swesbi.artefacts.atomic import ArtefactError, DamagedArtefactError, UnfitError, atomic_path
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

Item = TypeVar("Item")
Key = TypeVar("Key")
FOLDER: Final = "subjects"


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
        root, own = groups.get(ROOT, Group({})), replace(made, kind=cls.kind)
        whole = {**groups, ROOT: replace(root, attrs={**root.attrs, **own.attributes()})}
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


class Place(NamedTuple):
    """Where a result of a subject lies: ``<experiment>/subjects/<subject>/<file>``."""

    experiment: str
    subject: str

    def __str__(self) -> str:
        return f"subject {self.subject} in experiment {self.experiment!r}"


class Files(Mapping[Key, Item], Generic[Key, Item]):
    """Files of many by whose they are, each read when it is asked for, so that one is in memory at a time."""

    def __init__(self, name: str, paths: Sequence[Path], read: Callable[[Sequence[Path]], Item]) -> None:
        self.name, self._read = name, read
        self.paths: dict[Key, list[Path]] = {}
        for path in paths:
            self.paths.setdefault(self.key(path), []).append(path)

    @staticmethod
    def key(path: Path) -> Key:
        """Return whose file one is."""
        raise NotImplementedError

    def __getitem__(self, key: Key) -> Item:
        if key not in self.paths:
            raise UnfitError(self.name, f"no file of {key} is given; make it first")
        return self._read(self.paths[key])

    def __contains__(self, key: object) -> bool:
        """Tell whether there is a file, without reading it."""
        return key in self.paths

    def __iter__(self) -> Iterator[Key]:
        return iter(self.paths)

    def __len__(self) -> int:
        return len(self.paths)


class BySubject(Files[str, Item]):
    """Artefacts by the subjects that they name."""

    @staticmethod
    def key(path: Path) -> str:
        """Return the subject that an artefact names, or in whose folder another file lies."""
        return provenance_of(path).subject if path.suffix == ".h5" else path.parent.name


class ByPlace(Files[Place, Item]):
    """Results of subjects in several experiments."""

    @staticmethod
    def key(path: Path) -> Place:
        """Return the experiment and the subject in whose folder a file lies."""
        folders = path.parts[-4:-1]
        if len(folders) < 3 or folders[1] != FOLDER:
            raise ArtefactError(f"{path}: expected <experiment>/{FOLDER}/<subject>/{path.name}")
        return Place(folders[0], folders[2])


class ByExperiment(Files[str, Item]):
    """Files of whole experiments."""

    @staticmethod
    def key(path: Path) -> str:
        """Return the experiment in whose folder a file lies."""
        return path.parent.name


class ByName(Files[str, Item]):
    """Files that are named by what they are of."""

    @staticmethod
    def key(path: Path) -> str:
        """Return the name of a file without its suffix."""
        return path.stem


class TextFile:
    """The format of a text, or of texts by the names of their files without suffix."""

    def write(self, text: str | Mapping[str, str], path: Path) -> None:
        """Write the text of this file in UTF-8."""
        with atomic_path(path) as temporary:
            temporary.write_text(text if isinstance(text, str) else text[path.stem], encoding="utf-8")


Text = Annotated[str, TextFile()]
"""A text that is a file: LaTeX, HTML, YAML."""
Texts = Annotated[Mapping[str, str], TextFile()]
"""Texts that are files of one output, by their names without suffix."""


def read_as(hint: Any, paths: Sequence[Path], name: str) -> Any:  # noqa: ANN401
    """Read files as a type says; ``name`` is that of the input, for messages."""
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is tuple:
        return tuple(read_as(arguments[0], [path], name) for path in paths)
    if isinstance(origin, type) and issubclass(origin, Files):
        return origin(name, paths, lambda some: read_as(arguments[-1], some, name))
    if NoneType in arguments:
        return read_as(arguments[0], paths, name) if paths else None
    if not hasattr(hint, "joined"):
        (path,) = paths
        return path if hint is Path else _format(hint).read(path)
    try:
        if len(subjects := {provenance_of(path).subject for path in paths}) > 1:
            raise ArtefactError(f"files of several subjects, {', '.join(sorted(subjects))}, are given as one")
        return hint.joined([hint.read(path) for path in paths])
    except DamagedArtefactError:
        raise
    except ArtefactError as error:
        raise UnfitError(name, str(error)) from error


def write_as(hint: Any, value: Any, paths: Sequence[Path], made: Provenance) -> None:  # noqa: ANN401
    """Write a value to files as its type says: to one, or to each in the format of its name."""
    form = _format(hint)
    for path in paths:
        if form is hint:  # a union of types, too
            value.write(path, made)
        else:
            form.write(value, path)


def _format(hint: Any) -> Any:  # noqa: ANN401
    """Return what reads and writes a type."""
    return get_args(hint)[1] if hasattr(hint, "__metadata__") else hint
