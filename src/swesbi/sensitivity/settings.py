"""The variants of an experiment, each a change of the configuration."""

from __future__ import annotations

from typing import Final

from pydantic import Field, JsonValue

from swesbi.settings import Settings

BASE: Final = "base"
"""Name of the variant that changes nothing."""


class Variant(Settings):
    """One choice made otherwise; ``changes`` lie over the configuration as another file would."""

    label: str = Field(min_length=1, description="what figures and tables call it")
    changes: dict[str, JsonValue] = Field(description="keys of the configuration with their other values")
    full_training: bool = Field(
        default=False,
        description="train as long as the experiment does; else short, since exact weights make good for it",
    )
    fix_passive_scale: bool = Field(
        default=False,
        description="take the passive scale calibrated beforehand, as the paper does, for granted",
    )
