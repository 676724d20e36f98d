"""Settings of the choice of the discrepancy: the generated cohort, the grid, the effort."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from swesbi.checks.settings import DiscrepancyStudySettings
from swesbi.config.read import ConfigError
from swesbi.config.slices import fields_of
from swesbi.config.study import Study


class ChoiceSettings(DiscrepancyStudySettings):
    """The choice of the discrepancy for one experiment: the section ``discrepancy`` of config.yaml."""

    experiment: str = Field(min_length=1, description="an experiment of kind speeds")


def choice_settings(study: Study, choice: ChoiceSettings) -> dict[str, Any]:
    """Return what the choice depends on; the discrepancy that the experiment has already is not among it.

    Raises:
        ConfigError: The experiment is not of kind speeds.
    """
    known = study.config.speed_experiments
    if choice.experiment not in known:
        raise ConfigError(
            f"discrepancy.experiment = {choice.experiment!r} is no experiment of kind speeds; "
            f"known: {', '.join(known) or 'none'}"
        )
    section = choice.to_plain()
    none = {"speed_fraction": 0.0, "timing_cycle": 0.0}  # what is chosen already must not matter
    settings = fields_of(study, {"experiment": section.pop("experiment")}, "model acquisition recording")
    settings["model"]["discrepancy"] = none
    return settings | {"study": section}
