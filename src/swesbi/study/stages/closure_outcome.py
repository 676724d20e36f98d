"""Which natural waves are interpreted, told once for all recordings that have nothing else."""

from __future__ import annotations

from pathlib import Path

from swesbi.artefacts import write_json
from swesbi.base import Settings
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.population.settings import PopulationSettings
from swesbi.study.stages.origin import Origin
from swesbi.verdict.closure_speeds import closure_speeds
from swesbi.verdict.settings import NaturalWavesSettings


class ClosureOutcomeStageSettings(Settings):
    """The model, when its waves are interpreted, and the healthy hearts on which that rests."""

    model: SpeedModelSettings
    natural_waves: NaturalWavesSettings
    healthy: PopulationSettings


def closure_outcome(*, outcome: Path, settings: ClosureOutcomeStageSettings, origin: Origin) -> None:
    """Write why waves of each event are not interpreted; nothing is said of those that are.

    Args:
        outcome: Output, JSON.

    Raises:
        ArtefactError: The output cannot be written.
    """
    found = closure_speeds(settings.model, settings.healthy, settings.natural_waves, origin.seed)
    write_json(outcome, {one.event: "" if one.interpretable else one.why_not() for one in found})
