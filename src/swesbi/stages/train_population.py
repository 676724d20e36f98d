"""Stage: training one flow for every context of a population."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from swesbi.flow.files import KIND, save_flow
from swesbi.flow.phases import PhaseSettings
from swesbi.flow.settings import FlowSettings
from swesbi.population.conditions import ConditionSettings
from swesbi.population.dataset import read_population
from swesbi.population.rows import RowMaker
from swesbi.population.training import train_population
from swesbi.recording import RecordingSettings
from swesbi.seeds import integer_seed
from swesbi.settings import Settings
from swesbi.show.training_tables import write_epochs
from swesbi.speed_model.model import SpeedModelSettings
from swesbi.stages.origin import Origin
from swesbi.virtual_cohort import AcquisitionSettings


class TrainPopulationStageSettings(Settings):
    """What the trained flow depends on, beside the simulations."""

    model: SpeedModelSettings
    conditions: ConditionSettings
    acquisition: AcquisitionSettings
    recording: RecordingSettings
    estimator: FlowSettings


def run(
    *,
    shards: Sequence[Path],
    estimator: Path,
    training: Path,
    settings: TrainPopulationStageSettings,
    origin: Origin,
) -> None:
    """Train q(phi | z) on recordings drawn over the population; write weights and losses of every epoch.

    Runs on the CPU, on one thread, and repeats to the bit.

    Raises:
        ArtefactError: A shard is no such artefact.
        TrainingDivergedError: The loss was not finite too often.
    """
    phases = PhaseSettings(phases=settings.acquisition.phases, relative_se=settings.conditions.relative_se)
    maker = RowMaker(
        model=settings.model,
        conditions=settings.conditions,
        protocol=settings.acquisition,
        recording=settings.recording,
        phases=phases,
        seed=integer_seed(origin.seed, "population training"),
    )
    label = f"training {estimator.parent.name}"
    result = train_population(read_population(shards), maker, settings.estimator, label)
    save_flow(estimator, result.flow, origin.provenance(KIND, settings))
    write_epochs(training, result.epochs)
