"""Stage: one shard of successful simulations from the prior, for one subject."""

from __future__ import annotations

import logging
from pathlib import Path

from pydantic import Field

from swesbi.artefacts import save
from swesbi.forward_model.settings import ForwardModelSettings
from swesbi.prior import PriorSettings
from swesbi.recording.settings import ContextRow
from swesbi.settings import Settings
from swesbi.simulations.dataset import KIND, to_dataset
from swesbi.simulations.draw import draw_simulations
from swesbi.stages.origin import Origin

LOGGER = logging.getLogger("swesbi")


class SimulateSettings(Settings):
    """What a shard depends on; ``draws`` are its first draw number and the one after its last."""

    context: ContextRow
    prior: PriorSettings
    forward_model: ForwardModelSettings
    draws: tuple[int, int] = Field(description="first draw number, and the one after the last")


def run(*, shard: Path, settings: SimulateSettings, origin: Origin) -> None:
    """Write the shard of the draws named in the settings."""
    context = settings.context.to_context()
    simulations = draw_simulations(
        range(*settings.draws), context, settings.prior, settings.forward_model, origin.seed
    )
    save(shard, to_dataset(simulations), origin.provenance(KIND, settings))
    LOGGER.info(
        "subject %s: %d simulations, %d failed attempts redrawn",
        context.subject,
        len(simulations.theta),
        int(simulations.failures.sum()),
    )
