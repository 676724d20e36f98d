"""Training the flow of an experiment on measured speeds, or of one over a population."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from swesbi.artefacts import Origin
from swesbi.base.settings import Settings
from swesbi.measurement.likelihood import SpeedModelSettings, read_speed_models
from swesbi.measurement.settings import SummarySettings
from swesbi.networks.flow.cells import CellSettings
from swesbi.networks.flow.conditioning import ConditioningSettings, conditioning_of
from swesbi.networks.flow.files import KIND, save_flow
from swesbi.networks.flow.pool import of_subject, read_pool
from swesbi.networks.settings import SplineSettings
from swesbi.population.settings import ConditionSettings
from swesbi.population.simulations import read_population
from swesbi.recording.acquisition_settings import AcquisitionSettings
from swesbi.recording.settings import RecordingSettings
from swesbi.report.training_tables import write_epochs
from swesbi.seeds import integer_seed

LOGGER = logging.getLogger("swesbi")


class TrainFlowStageSettings(Settings):
    """What the trained flow depends on."""

    model: SpeedModelSettings
    summary: SummarySettings
    estimator: SplineSettings

    @property
    def conditioning(self) -> ConditioningSettings:
        """How measured speeds become the flow's input."""
        return conditioning_of(self.summary, self.model)


def train_flow(
    *,
    pool: Path,
    observations: Sequence[Path],
    noise: Path,
    estimator: Path,
    training: Path,
    settings: TrainFlowStageSettings,
    origin: Origin,
) -> None:
    """Train q(heart | z) on the pool of all subjects; write its weights and the losses of every epoch.

    Runs on the CPU, on one thread, and repeats exactly.

    Raises:
        ArtefactError: The pool lacks a subject.
        TrainingDivergedError: The loss was not finite too often.
    """
    # torch takes two seconds to import, and most who import this module only name the settings
    from swesbi.networks.flow.training import train_over_subjects

    label, pooled = f"training {estimator.parent.name}", read_pool(pool)
    models = read_speed_models(observations, noise, settings.model)
    subjects = [of_subject(pooled, model, pool) for model in models]
    seed = integer_seed(origin.seed, "flow training")
    result = train_over_subjects(subjects, settings.conditioning, settings.estimator, seed, label)
    save_flow(estimator, result.flow, origin.provenance(KIND, settings))
    write_epochs(training, result.epochs)


class TrainPopulationStageSettings(Settings):
    """What the trained flow depends on."""

    model: SpeedModelSettings
    conditions: ConditionSettings
    acquisition: AcquisitionSettings
    recording: RecordingSettings
    estimator: SplineSettings


def train_population(
    *,
    shards: Sequence[Path],
    estimator: Path,
    training: Path,
    settings: TrainPopulationStageSettings,
    origin: Origin,
) -> None:
    """Train q(heart | z) on recordings drawn over the population; write weights and losses of every epoch.

    Runs on the CPU, on one thread, and repeats exactly.

    Raises:
        ArtefactError: A shard is no such artefact.
        TrainingDivergedError: The loss was not finite too often.
    """
    # torch takes two seconds to import, and most who import this module only name the settings
    from swesbi.population.training import RowMaker
    from swesbi.population.training import train_population as train_on_population

    cells = CellSettings(cells=settings.acquisition.phases, relative_se=settings.conditions.seen_relative_se)
    maker = RowMaker(
        model=settings.model,
        conditions=settings.conditions,
        protocol=settings.acquisition,
        recording=settings.recording,
        cells=cells,
        seed=integer_seed(origin.seed, "population training"),
    )
    label = f"training {estimator.parent.name}"
    result = train_on_population(read_population(shards), maker, settings.estimator, label)
    save_flow(estimator, result.flow, origin.provenance(KIND, settings))
    write_epochs(training, result.epochs)
