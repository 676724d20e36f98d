"""Architecture of the flow and number of simulations: held-out log-probability and importance efficiency.

    python benchmarks/flow_choice.py --output docs/tables/flow_choice.csv

Every training takes the same number of gradient steps, half of the configured schedule, on the cohort's own
subjects (the study must have made results/cohort); every flow is judged on the same fresh theta. Takes about
a quarter of an hour on one core.
"""

from __future__ import annotations

import argparse
import logging
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from swesbi.config.read import read_yaml
from swesbi.config.slices import stage_settings
from swesbi.config.study import Study, load_study
from swesbi.measurement.likelihood import SpeedModel, read_speed_models
from swesbi.networks.settings import SplineSettings
from swesbi.networks.spline.net import TrainedSpline, log_q
from swesbi.networks.spline.pool import SubjectSimulations, at_phases
from swesbi.networks.spline.training import train_spline
from swesbi.population.synthetic import own_recordings
from swesbi.posterior.importance import flow_proposal, weigh
from swesbi.progress import Progress
from swesbi.show.csv import write_csv
from swesbi.simulations import draw_simulations
from swesbi.study.stages.flow_training import TrainFlowStageSettings

EXPERIMENT: Final = "calibrated"
SEED: Final = 7
FRESH: Final = 300  # recordings a subject whose log-probability is taken
WEIGHTED: Final = 20  # of them, those whose efficiency is measured
DRAWS: Final = 2000
ARCHITECTURES: Final = (
    {"model": "nsf"},
    {"model": "maf", "transforms": 5},
    {"model": "nsf", "hidden_features": 64},
    {"model": "nsf", "transforms": 5, "hidden_features": 64},
    {"model": "maf", "transforms": 5, "hidden_features": 64},
)
SHARES: Final = (0.125, 0.25, 0.5, 2.0)  # of the configured number of simulations, beside all of it


@dataclass(frozen=True)
class Choice:
    """One training and how its flow fares on fresh recordings."""

    model: str
    transforms: int
    hidden_features: int
    simulations_per_subject: int
    epochs: int
    training_s: float
    log_probability: float
    log_probability_se: float
    efficiency_median: float
    efficiency_low: float
    share_k_hat_above_limit: float


def main() -> None:
    """Train, judge and write one row a choice; print each as it comes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--config", type=Path, default=Path("config.yaml"))
    parser.add_argument("--output", type=Path, required=True, help="table to write")
    arguments = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    study = load_study(read_yaml(arguments.config))
    settings = TrainFlowStageSettings.from_plain(stage_settings(study, "train_flow", experiment=EXPERIMENT))
    models = _models(study, settings)
    wanted = study.config.speed_experiments[EXPERIMENT].simulations_per_subject
    largest = [_simulate(model, int(max(SHARES) * wanted)) for model in models]
    rows = []
    for estimator, count in _choices(settings.estimator, wanted):
        rows.append(_judge(models, largest, settings, estimator, count))
        print(asdict(rows[-1]), flush=True)
        write_csv(arguments.output, pd.DataFrame([asdict(row) for row in rows]))


def _choices(shipped: SplineSettings, wanted: int) -> list[tuple[SplineSettings, int]]:
    """Return architectures at the configured number of simulations, then the configured one at others."""
    half = shipped.model_copy(update={"epochs": max(shipped.epochs // 2, 1)})
    of_architecture = [(half.model_copy(update=dict(change)), wanted) for change in ARCHITECTURES]
    steps = half.epochs * wanted
    of_number = [
        (half.model_copy(update={"epochs": max(round(steps / (share * wanted)), 1)}), int(share * wanted))
        for share in SHARES
    ]
    return of_architecture + of_number


def _models(study: Study, settings: TrainFlowStageSettings) -> tuple[SpeedModel, ...]:
    cohort = Path(study.config.results) / "cohort"
    observations = [cohort / subject / "observation.h5" for subject in study.subjects_of(EXPERIMENT)]
    return read_speed_models(observations, cohort / "noise.h5", settings.model)


def _simulate(model: SpeedModel, count: int) -> SubjectSimulations:
    prior, context = model.settings.prior.theta, model.recording.context
    drawn = draw_simulations(range(count), context, prior, model.settings.forward_model, SEED)
    return at_phases(drawn, model)


def _judge(
    models: Sequence[SpeedModel],
    largest: Sequence[SubjectSimulations],
    settings: TrainFlowStageSettings,
    estimator: SplineSettings,
    count: int,
) -> Choice:
    begin = time.process_time()
    simulations = [part.rows(0, count) for part in largest]
    flow = train_spline(
        simulations, settings.conditioning, estimator, SEED, f"{estimator.model} {count}"
    ).spline
    seconds = time.process_time() - begin
    log_probability, efficiency, k_hat = _on_fresh_recordings(models, flow)
    return Choice(
        model=estimator.model,
        transforms=estimator.transforms,
        hidden_features=estimator.hidden_features,
        simulations_per_subject=count,
        epochs=estimator.epochs,
        training_s=seconds,
        log_probability=float(log_probability.mean()),
        log_probability_se=float(log_probability.std(ddof=1) / np.sqrt(len(log_probability))),
        efficiency_median=float(np.median(efficiency)),
        efficiency_low=float(np.quantile(efficiency, 0.05)),
        share_k_hat_above_limit=float(np.mean(k_hat > 1.0 - 1.0 / np.log10(DRAWS))),
    )


def _on_fresh_recordings(
    models: Sequence[SpeedModel], flow: TrainedSpline
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    log_probability, efficiency, k_hat = [], [], []
    progress = Progress("fresh recordings", len(models) * FRESH, unit="recording")
    for model in models:
        fresh = own_recordings(model, FRESH, SEED, "flow choice")
        for index, (phi, recording) in enumerate(zip(fresh.phi, fresh.recordings, strict=True)):
            condition = flow.conditioner.condition(recording)
            log_probability.append(log_q(flow, condition, phi[None])[0])
            if index < WEIGHTED:
                own = replace(model, recording=recording)
                weighted = weigh(own, flow_proposal(flow, recording), DRAWS, 0.1, SEED)
                efficiency.append(weighted.efficiency)
                k_hat.append(weighted.k_hat)
            progress.step()
    return np.array(log_probability), np.array(efficiency), np.array(k_hat)


if __name__ == "__main__":
    main()
