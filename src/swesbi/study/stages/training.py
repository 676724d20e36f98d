"""Training the density estimator of one experiment with noise on features."""

from __future__ import annotations

import logging
from pathlib import Path

from swesbi.artefacts import Origin
from swesbi.base.settings import Settings
from swesbi.checks.settings import CheckpointEpochs
from swesbi.networks.paper.estimator import CHECKPOINTS, save_checkpoints, save_estimator
from swesbi.networks.paper.estimator import ESTIMATOR as KIND
from swesbi.networks.paper.pool import read_pool
from swesbi.networks.paper.training import choose_device
from swesbi.networks.paper.training import train as train_estimator
from swesbi.networks.settings import EstimatorSettings
from swesbi.prior import PriorSettings
from swesbi.report.training_tables import write_epochs
from swesbi.seeds import integer_seed

LOGGER = logging.getLogger("swesbi")


class TrainStageSettings(Settings):
    """What the estimator depends on."""

    prior: PriorSettings
    estimator: EstimatorSettings
    checkpoint_epochs: CheckpointEpochs


def train(
    *,
    pool: Path,
    estimator: Path,
    training: Path,
    checkpoints: Path,
    settings: TrainStageSettings,
    origin: Origin,
    device: str = "auto",
) -> None:
    """Train q(theta | z) on the pool; write its weights, the losses of every epoch, and checkpoints.

    The checkpoints are the weights after the epochs that the settings name, the best and the last.
    ``device`` is "auto", "cpu" or "cuda". On the CPU the result repeats exactly; CUDA sums in another
    order, so its weights differ in rounding, and no more than another seed's would.
    """
    label, device = f"training {estimator.parent.name}", choose_device(device, settings.estimator.procedure)
    data = read_pool(pool)
    procedure = settings.estimator.procedure
    LOGGER.info("%s: %d rows of %d components on %s, procedure %s", label, *data.z.shape, device, procedure)
    result = train_estimator(
        data.theta,
        data.z,
        data.components.names,
        settings.prior,
        settings.estimator,
        integer_seed(origin.seed, "training"),
        device,
        label,
        settings.checkpoint_epochs,
    )
    trained = result.estimator
    save_estimator(estimator, trained, origin.provenance(KIND, settings))
    save_checkpoints(
        checkpoints,
        result.weights,
        trained.best_epoch,
        trained.settings,
        trained.components,
        origin.provenance(CHECKPOINTS, settings),
    )
    write_epochs(training, result.epochs)
