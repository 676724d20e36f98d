"""The passive baseline as an artefact."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from swesbi.artefacts import from_dataset, load, register, schema_of
from swesbi.observation.passive import PassiveBaseline

KIND: Final = register("passive", schema_of(PassiveBaseline))


def read_passive(path: Path) -> PassiveBaseline:
    """Read the passive baseline of one subject.

    Raises:
        ArtefactError: The file is no such artefact.
    """
    return from_dataset(PassiveBaseline, load(path, KIND)[0])
