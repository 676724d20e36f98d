"""The manifest of claims, ``docs/claims.yaml``: which words claim a number, and what tells if it is true.

A claim quotes its text with ``{}`` in the place of each number. The expected value is the number that stands
there, so a page that is written anew keeps its manifest; other words around it do not.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final, Literal, Self

import yaml
from pydantic import Field, ValidationError, model_validator

from swesbi.artefacts import ArtefactError
from swesbi.base.settings import Settings

HOLE: Final = "{}"
Reduction = Literal["only", "sum", "mean", "median", "min", "max", "count", "distinct"]
"""What is made of the values of several rows: ``only`` takes the one that there is."""


class ValueSource(Settings):
    """Where the value of one number is found; ``docs/claims.yaml`` says what each key means.

    A value is a column, or an expression in columns, of a table; keys, parted by points, of settings; a
    constant of a module; of another text the words around a number, with a hole.
    """

    of: str = Field(min_length=1)
    value: str = Field(min_length=1)
    where: str = ""
    by: Reduction = "only"
    times: float = 1.0
    tolerance: float | None = Field(default=None, gt=0.0)


class Claim(Settings):
    """Words of a file that claim numbers, each in a hole of the text, and where each is found."""

    file: str = "README.md"
    text: str = Field(min_length=1)
    found: tuple[ValueSource, ...] = Field(min_length=1)

    @model_validator(mode="after")
    def _check_holes(self) -> Self:
        if self.text.count(HOLE) != len(self.found):
            raise ValueError(f"{self.text!r} has {self.text.count(HOLE)} holes and {len(self.found)} values")
        return self


class NoClaim(Settings):
    """Words of a file with numbers that claim nothing, and why."""

    file: str = "README.md"
    text: str = Field(min_length=1)
    reason: str = Field(min_length=1)


class Manifest(Settings):
    """All claims, and by name the sources of values; of ``complete`` files every number stands here.

    Of files in ``shares`` every number in per cent does, but for levels of intervals.
    """

    complete: tuple[str, ...] = ()
    shares: tuple[str, ...] = ()
    sources: dict[str, str]
    claims: tuple[Claim, ...]
    no_claims: tuple[NoClaim, ...] = ()

    @property
    def quoted(self) -> tuple[Claim | NoClaim, ...]:
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
    """Read the manifest."""
    try:
        return Manifest.from_plain(yaml.safe_load(path.read_text(encoding="utf-8")))
    except (OSError, yaml.YAMLError, ValidationError) as error:
        raise ArtefactError(f"{path}: cannot be read as a manifest of claims ({error})") from error
