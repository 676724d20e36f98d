"""The manifest of claims, ``docs/claims.yaml``: which words claim a number, and what tells if it is true.

A claim quotes its text with ``{}`` in the place of each number. The expected value is the number that stands
there, so a page that is written anew keeps its manifest; other words around it do not.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final, Literal, Self

import yaml
from pydantic import Field, ValidationError, model_validator

from swesbi.artefacts import ArtefactError
from swesbi.base.settings import Settings

HOLE: Final = "{}"
RESULTS: Final = "results/"
"""How the path of a table of a study begins; the configuration says where its results really lie."""

Study = Literal["full", "small", "none"]
"""Whose results are asked: the study as shipped, the smoke study, or none: what the repository holds."""
Reduction = Literal["only", "sum", "mean", "median", "min", "max", "count", "distinct"]
"""What is made of the values of several rows: ``only`` takes the one that there is."""


class TableSource(Settings):
    """A table as CSV.

    Attributes:
        holds: Of which study's results the claims on it are true; what the repository holds is always asked.
    """

    kind: Literal["table"]
    path: str = Field(min_length=1)
    made_by: str = Field(min_length=1, description="the command that makes it")
    holds: Literal["full", "any"] = "full"


class PageSource(Settings):
    """A table between the marks of a page, which `make docs` writes."""

    kind: Literal["page"]
    path: str = Field(min_length=1)
    part: str = Field(min_length=1, description="name of the marked part")
    made_by: str = Field(min_length=1)


class YamlSource(Settings):
    """A file of settings, or the whole configuration; a value is named by its keys, parted by points."""

    kind: Literal["yaml"]
    path: str = Field(min_length=1)
    made_by: str = Field(min_length=1)


class CodeSource(Settings):
    """A module of the package; a value is the name of one of its constants."""

    kind: Literal["code"]
    module: str = Field(pattern=r"^swesbi(\.[a-z_]+)*$")
    made_by: str = Field(min_length=1)


class TextSource(Settings):
    """A text in which a number stands; a value is the words around it, with a hole."""

    kind: Literal["text"]
    path: str = Field(min_length=1)
    made_by: str = Field(min_length=1)


Source = Annotated[
    TableSource | PageSource | YamlSource | CodeSource | TextSource, Field(discriminator="kind")
]


class Found(Settings):
    """Where the value of one number is found.

    Attributes:
        of: Name of the source.
        value: Column, or expression in columns, of a table; keys, constant or words of other sources.
        where: The rows of a table that count, as pandas queries them; all by default.
        by: What is made of several values.
        times: What the value is multiplied by: 100 for a share that is printed in percent.
        tolerance: By how much both may differ; what rounding to the printed digits allows by default.
    """

    of: str = Field(min_length=1)
    value: str = Field(min_length=1)
    where: str = ""
    by: Reduction = "only"
    times: float = 1.0
    tolerance: float | None = Field(default=None, gt=0.0)


class Quoted(Settings):
    """Words of a file."""

    file: str = Field(min_length=1)
    text: str = Field(min_length=1)


class Claim(Quoted):
    """Words that claim numbers, each in a hole of the text, and where each is found."""

    found: tuple[Found, ...] = Field(min_length=1)

    @model_validator(mode="after")
    def _check_holes(self) -> Self:
        if self.text.count(HOLE) != len(self.found):
            raise ValueError(f"{self.text!r} has {self.text.count(HOLE)} holes and {len(self.found)} values")
        return self


class NoClaim(Quoted):
    """Words with numbers that claim nothing, and why."""

    reason: str = Field(min_length=1)


class Manifest(Settings):
    """All claims.

    Attributes:
        complete: Files of which every number is claimed, or said to be no claim.
        sources: Where values are found, by name.
        claims: The claims.
        no_claims: Numbers that are none.
    """

    complete: tuple[str, ...]
    sources: dict[str, Source]
    claims: tuple[Claim, ...]
    no_claims: tuple[NoClaim, ...]

    @property
    def quoted(self) -> tuple[Quoted, ...]:
        """All words that are quoted."""
        return (*self.claims, *self.no_claims)

    @model_validator(mode="after")
    def _check_sources(self) -> Self:
        named = {found.of for claim in self.claims for found in claim.found}
        if unknown := sorted(named - set(self.sources)):
            raise ValueError(f"no source is called {unknown[0]!r}; there are {', '.join(self.sources)}")
        if idle := sorted(set(self.sources) - named):
            raise ValueError(f"no claim asks the source {idle[0]!r}; delete it")
        return self


def read_manifest(path: Path) -> Manifest:
    """Read the manifest.

    Raises:
        ArtefactError: The file cannot be read, or an entry is wrong.
    """
    try:
        return Manifest.from_plain(yaml.safe_load(path.read_text(encoding="utf-8")))
    except (OSError, yaml.YAMLError, ValidationError) as error:
        raise ArtefactError(f"{path}: cannot be read as a manifest of claims ({error})") from error
