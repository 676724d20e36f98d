"""What a stage records of where its output comes from."""

from __future__ import annotations

from dataclasses import dataclass

from swesbi.artefacts import Provenance
from swesbi.settings import Settings


@dataclass(frozen=True)
class Origin:
    """The study's seed, the subject (empty for the whole cohort) and the hash of the stage's code."""

    seed: int
    subject: str = ""
    code_hash: str = ""

    def provenance(self, kind: str, settings: Settings) -> Provenance:
        """Return the provenance of an artefact of this ``kind`` made under these ``settings``."""
        return Provenance(kind, self.subject, self.seed, settings.to_plain(), self.code_hash)
