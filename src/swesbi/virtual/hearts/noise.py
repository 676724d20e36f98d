"""How noisy other hearts are recorded: by a factor, or as (g) has it."""

from __future__ import annotations

from typing import Final

from swesbi.prior import ParameterPrior
from swesbi.recording.acquisition_settings import AcquisitionSettings

LOUD_FACTOR: Final = 2.0
"""Errors of (g) over those of the acquisition, and over the assumed width of the scale of the speeds."""


def noisier(acquisition: AcquisitionSettings, factor: float) -> AcquisitionSettings:
    """Return the acquisition with so many times the errors of samples, repeats and sweeps."""
    names = ("sample_sd_fraction", "repeat_sd_fraction", "sweep_fraction")
    return acquisition.model_copy(update={name: factor * getattr(acquisition, name) for name in names})


def louder(acquisition: AcquisitionSettings, speed_scale: ParameterPrior) -> AcquisitionSettings:
    """Return the acquisition of (g): larger errors of repeats and sweeps, and of the scale of all speeds.

    Args:
        acquisition: That of the other generators.
        speed_scale: Prior of that scale, whose width is what inference assumes.
    """
    changes = {
        "repeat_sd_fraction": LOUD_FACTOR * acquisition.repeat_sd_fraction,
        "sweep_fraction": LOUD_FACTOR * acquisition.sweep_fraction,
        "scale_fraction": LOUD_FACTOR * speed_scale.log_sd,
    }
    return acquisition.model_copy(update=changes)
