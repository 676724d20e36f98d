"""Settings of the cohort's noise."""

from __future__ import annotations

from pydantic import Field

from swesbi.settings import Settings


class NoiseSettings(Settings):
    """How the uncertainty of the variance components is told."""

    interval: float = Field(gt=0, lt=1, description="mass of the profile-likelihood intervals")
