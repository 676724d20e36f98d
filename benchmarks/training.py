"""sbi's own training beside the fast one: time to the same log-probability of recordings never seen.

    python benchmarks/training.py
    python benchmarks/training.py --epochs 5
    python benchmarks/training.py --experiment scalar_only --procedures stock sbi fast

Reads the pool of a finished study. `stock` is sbi as installed, its own loader included; `sbi` and `fast` are
the values of `estimator.procedure`. The judge is the mean of log q(theta | z) over recordings of fresh theta
under the experiment's observation model: the rows that sbi holds out share theta with rows it trains on.
Each procedure starts with the same weights and runs on one thread; judging is not counted.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, get_args

import numpy as np
import pandas as pd
import torch
from sbi.inference import NPE_C
from sbi.neural_nets import posterior_nn
from torch import Tensor

from swesbi.checks.recovery import own_recovery, synthetic_recordings
from swesbi.config.read import read_merged
from swesbi.config.study import Study, load_study
from swesbi.config.view import View
from swesbi.measurement.likelihood import measured_subjects
from swesbi.measurement.operator import PassiveBaseline
from swesbi.networks.paper.pool import Pool
from swesbi.networks.paper.training import trained_network, trainer_of
from swesbi.networks.settings import EstimatorSettings, Procedure
from swesbi.networks.torch_prior import torch_prior
from swesbi.networks.training import EpochRecord, reproducible
from swesbi.prior import PriorSettings
from swesbi.recording.observation import Observation
from swesbi.seeds import integer_seed
from swesbi.study.job import typed_settings
from swesbi.study.stage import plain_settings

CPU: Final = "cpu"
COLUMNS: Final = ("epoch", "cpu_s", "wall_s", "validation_loss", "held_out_log_q")
STEPS_BELOW: Final = (0.0, 0.5, 1.0, 2.0)
"""Levels of log q at which times are compared, in nats below the one that every procedure reached."""


@dataclass(frozen=True)
class Rows:
    """theta (n, 3) and standardised conditioning vectors (n, C)."""

    theta: Tensor
    z: Tensor


@dataclass
class Watch:
    """Judges the network after each epoch, with the clocks stopped."""

    held_out: Rows
    epochs: list[dict[str, float]] = field(default_factory=list)
    _best: tuple[float, float] = (np.inf, np.nan)
    _start: tuple[float, float] = field(default_factory=lambda: _clocks())

    def look(self, net: Any, validation_loss: float) -> None:  # noqa: ANN401
        """Record an epoch. The network kept is that of the lowest validation loss so far."""
        now = _clocks()
        if validation_loss < self._best[0]:
            self._best = validation_loss, log_q(net, self.held_out)
        spent = (at - start for at, start in zip(now, self._start, strict=True))
        values = (len(self.epochs) + 1, *spent, validation_loss, self._best[1])
        self.epochs.append(dict(zip(COLUMNS, values, strict=True)))
        paused = _clocks()
        self._start = (self._start[0] + paused[0] - now[0], self._start[1] + paused[1] - now[1])


def _clocks() -> tuple[float, float]:
    return time.process_time(), time.perf_counter()


def log_q(net: Any, rows: Rows) -> float:  # noqa: ANN401
    """Return the mean of log q(theta | z) over the rows."""
    with torch.no_grad():
        return -float(net.loss(rows.theta, rows.z).mean())


def watched(kind: type, watch: Watch) -> type:
    """Return the trainer with the watch's look after every epoch; sbi calls the method then."""

    class Watched(kind):
        def _summarize_epoch(self, train_loss: float, val_loss: float, *args: object) -> None:
            super()._summarize_epoch(train_loss, val_loss, *args)
            watch.look(self._neural_net, val_loss)

    return Watched


class _Quiet:
    """Stands for the tracker of a trainer, and keeps nothing."""

    log_dir = None

    def log_metric(self, name: str, value: float, step: int | None = None) -> None: ...

    def flush(self) -> None: ...


def run(
    procedure: str,
    pool: Rows,
    held_out: Rows,
    prior: PriorSettings,
    settings: EstimatorSettings,
    seed: int,
) -> pd.DataFrame:
    """Train by one procedure and return a row an epoch."""
    with reproducible(seed), contextlib.redirect_stdout(io.StringIO()):
        watch = Watch(held_out)
        if procedure == "stock":
            trainer = watched(NPE_C, watch)(
                prior=torch_prior(prior, CPU),
                density_estimator=posterior_nn(
                    settings.model,
                    z_score_theta=settings.z_score_theta,
                    z_score_x=settings.z_score_x,
                    hidden_features=settings.hidden_features,
                    num_transforms=settings.transforms,
                    num_blocks=settings.blocks,
                ),
                device=CPU,
                tracker=_Quiet(),
                show_progress_bars=False,
            )
        else:
            record = EpochRecord(procedure, settings.max_num_epochs + 1)
            trainer = watched(trainer_of(procedure), watch)(record, prior, settings, CPU, ())
        trainer.append_simulations(pool.theta, pool.z, exclude_invalid_x=False)
        trainer.train(
            training_batch_size=settings.batch_size,
            learning_rate=settings.learning_rate,
            validation_fraction=settings.validation_fraction,
            stop_after_epochs=settings.stop_after_epochs,
            max_num_epochs=settings.max_num_epochs,
            clip_max_norm=settings.clip_max_norm,
        )
    return pd.DataFrame(watch.epochs)


def speeds(runs: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Return a row a procedure: seconds an epoch, and log q where it ended."""
    ends = {name: epochs.iloc[-1] for name, epochs in runs.items()}
    rows = {
        name: {
            "epochs": int(last["epoch"]),
            "CPU s/epoch": last["cpu_s"] / last["epoch"],
            "wall s/epoch": last["wall_s"] / last["epoch"],
            "held-out log q": last["held_out_log_q"],
        }
        for name, last in ends.items()
    }
    return pd.DataFrame.from_dict(rows, orient="index")


def times(runs: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Return the time of each procedure to levels that all reached, and that of the first over it."""
    lowest = min(epochs["held_out_log_q"].iloc[-1] for epochs in runs.values())
    rows = []
    for level in (lowest - below for below in STEPS_BELOW):
        first: pd.Series | None = None
        for name, epochs in runs.items():
            at = epochs[epochs["held_out_log_q"] >= level].iloc[0]
            first = at if first is None else first
            ratios = {f"ratio {clock}": first[clock] / at[clock] for clock in ("cpu_s", "wall_s")}
            rows.append({"log q": level, "procedure": name, **at[["epoch", "cpu_s", "wall_s"]], **ratios})
    return pd.DataFrame(rows)


def settings_of(study: Study, experiment: str) -> dict[str, Any]:
    """Return by name what training and recovery of an experiment depend on."""
    found: dict[str, Any] = {}
    for stage in (trained_network, own_recovery):
        place = f"{stage.__module__}:{stage.__name__}"
        plain = plain_settings(place, View(study, {"experiment": experiment})) | {"seed": study.config.seed}
        found |= typed_settings(stage, plain)
    return found


def read_held_out(
    results: Path, subjects: Sequence[str], asked: Mapping[str, Any], each: int
) -> tuple[np.ndarray, np.ndarray]:
    """Simulate fresh theta (n, 3) for each subject of a study, and raw conditioning vectors (n, C)."""
    folders = {subject: results / "cohort" / subject for subject in subjects}
    measured = measured_subjects(
        [Observation.read(folder / "observation.h5") for folder in folders.values()],
        {subject: PassiveBaseline.read(folder / "passive.h5") for subject, folder in folders.items()},
        asked["measurement"],
    )
    names = ("prior", "forward_model", "summary", "observation_model")
    seed = integer_seed(asked["seed"], "training benchmark")
    return synthetic_recordings(
        measured, each * len(subjects), **{name: asked[name] for name in names}, seed=seed
    )


def _tensors(theta: np.ndarray, z: np.ndarray) -> Rows:
    return Rows(torch.from_numpy(theta.astype(np.float32)), torch.from_numpy(z.astype(np.float32)))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--config", type=Path, default=Path("config.yaml"))
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder of a finished study")
    parser.add_argument("--experiment", default="paper", help="an experiment of kind features")
    parser.add_argument("--epochs", type=int, help="at most so many, instead of the experiment's own")
    parser.add_argument("--recordings", type=int, default=500, help="held-out recordings of each subject")
    parser.add_argument(
        "--procedures", nargs="+", default=["stock", "fast"], choices=["stock", *get_args(Procedure)]
    )
    parser.add_argument("--seed", type=int, default=1, help="of weights, split and batches")
    return parser.parse_args()


def main() -> None:
    """Train by each procedure in turn and print the tables."""
    arguments = _arguments()
    study = load_study(read_merged(arguments.config), str(arguments.config))
    experiment = arguments.experiment
    asked = settings_of(study, experiment)
    data = Pool.read(arguments.results / experiment / "pool.h5")
    truth, raw = read_held_out(arguments.results, data.subjects, asked, arguments.recordings)
    held_out, pool = _tensors(truth, data.standardisation.apply(raw)), _tensors(data.theta, data.z)
    settings, prior = asked["estimator"], asked["prior"]
    if arguments.epochs is not None:
        settings = settings.model_copy(update={"max_num_epochs": arguments.epochs - 1})
    few = settings.model_copy(update={"max_num_epochs": 1})
    runs: dict[str, pd.DataFrame] = {}
    shape = f"{len(pool.z)} rows of {pool.z.shape[1]} components"
    print(f"{experiment}: {shape}, {len(truth)} recordings never seen")
    for procedure in arguments.procedures:
        some = Rows(pool.theta[:1000], pool.z[:1000])
        run(procedure, some, held_out, prior, few, 0)  # imports, caches
        runs[procedure] = run(procedure, pool, held_out, prior, settings, arguments.seed)
    print(speeds(runs).to_string(float_format="%.3f"))
    print(times(runs).to_string(index=False, float_format="%.3f"))
    print("ratio: time of the first procedure over that of the other")


if __name__ == "__main__":
    main()
