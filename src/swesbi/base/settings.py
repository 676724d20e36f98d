"""What every settings model shares: strict, frozen, no unknown key; value types of several; plain data."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field


class Settings(BaseModel):
    """Base of every settings model.

    Values are checked as JSON is, so a number written as text (YAML reads ``1e-3`` as a
    string) is refused rather than guessed, while a list may fill a tuple.

    The first sentence of a field's description is its meaning, what follows is the reason of the shipped
    value. The hash of the code leaves descriptions out.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    @classmethod
    def from_plain(cls, plain: object) -> Self:
        """Validate plain data (dict, list, str, number), as read from YAML or from a rule's params."""
        return cls.model_validate_json(json.dumps(plain))

    def to_plain(self) -> dict[str, Any]:
        """Return plain, key-sorted data: the form that rules pass and artefacts record."""
        plain: dict[str, Any] = json.loads(json.dumps(self.model_dump(mode="json"), sort_keys=True))
        return plain


def flatten(plain: object) -> dict[str, str]:
    """Return nested plain data as text by key: ``{"prior": {"low": 2}}`` becomes ``{"prior.low": "2"}``."""
    leaves = _leaves(plain if isinstance(plain, Mapping) else {"": plain})
    return {key: ", ".join(map(str, one if isinstance(one, list | tuple) else [one])) for key, one in leaves}


def _leaves(nested: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in nested.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{above}{key}.")
        else:
            yield f"{above}{key}", value


def _check_window(window: tuple[float, float]) -> tuple[float, float]:
    start, end = window
    if not 0.0 <= start < end <= 1.0:
        raise ValueError(f"a window of the cycle needs 0 <= start < end <= 1, got [{start}, {end}]")
    return window


CycleWindow = Annotated[
    tuple[float, float],
    AfterValidator(_check_window),
    Field(
        description="Start and end of a part of the cardiac cycle, as fractions of it from the R peak.",
        json_schema_extra={"unit": "cycle", "allowed": "[start, end] with 0 ≤ start < end ≤ 1"},
    ),
]
Level = Annotated[float, Field(gt=0.0, lt=1.0)]
