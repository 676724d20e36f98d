"""Stage: a part of the recordings of fresh contexts, inferred by both samplers."""

from __future__ import annotations

from pathlib import Path

from swesbi.artefacts import save
from swesbi.calibration.settings import RecordingsSettings
from swesbi.exact.settings import ExactSettings, RefinementSettings
from swesbi.flow.files import load_flow
from swesbi.population.calibration import infer_fresh
from swesbi.population.calibration_dataset import KIND, fresh_dataset
from swesbi.population.recordings import ACQUIRED, OWN, FreshSettings
from swesbi.settings import Settings
from swesbi.stages.origin import Origin


class PopulationCalibrationStageSettings(Settings):
    """What a part depends on, beside the network."""

    own: tuple[int, int]
    acquired: tuple[int, int]
    fresh: FreshSettings
    sizes: RecordingsSettings
    exact: ExactSettings
    refinement: RefinementSettings


def run(*, estimator: Path, part: Path, settings: PopulationCalibrationStageSettings, origin: Origin) -> None:
    """Infer one recording of each of the numbered contexts, under the model's own noise and acquired.

    Raises:
        ArtefactError: The network is no such artefact.
    """
    flow, _ = load_flow(estimator)
    numbers = {OWN: range(*settings.own), ACQUIRED: range(*settings.acquired)}
    groups = {
        kind: fresh_dataset(
            infer_fresh(
                index,
                kind,
                flow,
                settings.fresh,
                settings.sizes,
                settings.exact,
                settings.refinement,
                origin.seed,
            )
        )
        for kind, index in numbers.items()
    }
    save(part, groups, origin.provenance(KIND, settings))
