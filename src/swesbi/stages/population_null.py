"""Stage: nulls of the misspecification tests over a population."""

from __future__ import annotations

from pathlib import Path

from swesbi.artefacts import save
from swesbi.flow.conditioning import conditioning_of
from swesbi.flow.files import load_flow
from swesbi.misspecification.settings import RuleSettings
from swesbi.observation.settings import SummarySettings
from swesbi.population.null import draw_null
from swesbi.population.null_dataset import KIND, to_dataset
from swesbi.population.recordings import FreshSettings
from swesbi.population.settings import NullSettings
from swesbi.settings import Settings
from swesbi.stages.origin import Origin


class PopulationNullStageSettings(Settings):
    """What the nulls depend on, beside the network."""

    fresh: FreshSettings
    summary: SummarySettings
    sizes: NullSettings
    rule: RuleSettings


def run(*, estimator: Path, null: Path, settings: PopulationNullStageSettings, origin: Origin) -> None:
    """Make well-specified recordings of fresh contexts, infer each, and keep what the tests look at.

    Raises:
        ArtefactError: The network is no such artefact.
    """
    conditioning = conditioning_of(settings.summary, settings.fresh.model)
    flow, _ = load_flow(estimator)
    found = draw_null(
        range(settings.sizes.recordings), flow, settings.fresh, conditioning, settings.sizes, settings.rule,
        origin.seed,
    )  # fmt: skip
    save(null, to_dataset(found), origin.provenance(KIND, settings))
