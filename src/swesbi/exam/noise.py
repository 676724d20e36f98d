"""How noisy hearts of the exam are recorded: as the cohort, as the cohort was formerly, or as (g) has it."""

from __future__ import annotations

from swesbi.exam.settings import MadeSettings
from swesbi.prior import ParameterPrior
from swesbi.virtual_cohort.settings import AcquisitionSettings


def noisier(acquisition: AcquisitionSettings, factor: float) -> AcquisitionSettings:
    """Return the acquisition with so many times the errors of samples, repeats and sweeps."""
    names = ("sample_sd_fraction", "repeat_sd_fraction", "sweep_fraction")
    return acquisition.model_copy(update={name: factor * getattr(acquisition, name) for name in names})


def louder(
    acquisition: AcquisitionSettings, settings: MadeSettings, speed_scale: ParameterPrior
) -> AcquisitionSettings:
    """Return the acquisition of (g): larger errors of repeats and sweeps, and of the scale of all speeds.

    Args:
        acquisition: That of the other generators.
        settings: How much larger.
        speed_scale: Prior of that scale, whose width is what inference assumes.
    """
    factor = settings.loud_factor
    changes = {
        "repeat_sd_fraction": factor * acquisition.repeat_sd_fraction,
        "sweep_fraction": factor * acquisition.sweep_fraction,
        "scale_fraction": factor * speed_scale.log_sd,
    }
    return acquisition.model_copy(update=changes)
