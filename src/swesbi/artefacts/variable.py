"""The description of one dataset of an artefact."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Variable:
    """One dataset of an artefact: its dimensions, units and meaning, and whether it holds text.

    Labels, which have the name of their dimension, may hold either.
    """

    dims: tuple[str, ...]
    units: str
    meaning: str
    text: bool = False


Schema = Mapping[str, Mapping[str, Variable]]
"""Of one kind of artefact: group name -> dataset name -> variable; the group "/" is the root."""

Labels = Mapping[str, tuple[str, ...]]
"""Of one kind of artefact: group name -> the text labels that its readers need."""
