"""The common behaviour of every settings model: strict, frozen, no unknown key."""

from __future__ import annotations

import json
from typing import Any, Self

from pydantic import BaseModel, ConfigDict


class Settings(BaseModel):
    """Base of every settings model.

    Values are checked as JSON is, so a number written as text (YAML reads ``1e-3`` as a
    string) is refused rather than guessed, while a list may fill a tuple.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    @classmethod
    def from_plain(cls, plain: object) -> Self:
        """Validate plain data (dict, list, str, number), as read from YAML or from a rule's params.

        Raises:
            pydantic.ValidationError: A key is unknown or missing, or a value has the wrong type or range.
        """
        return cls.model_validate_json(json.dumps(plain))

    def to_plain(self) -> dict[str, Any]:
        """Return plain, key-sorted data: the form that rules pass and artefacts record."""
        plain: dict[str, Any] = json.loads(json.dumps(self.model_dump(mode="json"), sort_keys=True))
        return plain
