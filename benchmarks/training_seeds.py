"""What training by sbi's own loop and by the fast one leaves different, beside what another seed does.

    python benchmarks/training_seeds.py --networks networks
    python benchmarks/training_seeds.py --networks networks --experiment scalar_only --seeds 1 2

Trains each procedure under each seed and keeps the networks in a folder; those that are there are not trained
again. Prints the quantities that the study reports, by procedure: mean and standard deviation over seeds, and
the difference of the means over its standard error. Reads a finished study.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pandas as pd
from training import read_held_out, read_measured, settings_of

from swesbi.artefacts import Provenance
from swesbi.checks.draws import score_theta
from swesbi.checks.recovery import recover, score_recovery
from swesbi.config.read import read_merged
from swesbi.config.study import Study, load_study
from swesbi.measurement.likelihood import MeasuredSubject
from swesbi.networks.paper.estimator import TrainedEstimator
from swesbi.networks.paper.maf import draw_candidates, losses
from swesbi.networks.paper.pool import Pool
from swesbi.networks.paper.training import train
from swesbi.networks.settings import Procedure
from swesbi.parameters import THETA_NAMES
from swesbi.prior import in_bounds
from swesbi.verdict.verdict import Verdict

DRAWS = 2000
LEVEL = 0.9


@dataclass(frozen=True)
class Case:
    """One experiment of a finished study."""

    name: str
    pool: Pool
    asked: dict[str, Any]
    supported: tuple[MeasuredSubject, ...]
    truth: np.ndarray
    z: np.ndarray


def read_case(study: Study, name: str, results: Path, each: int) -> Case:
    """Read pool and supported subjects, and simulate recordings of fresh theta."""
    asked = settings_of(study, name)
    pool = Pool.read(results / name / "pool.h5")
    verdicts = {s: results / name / "subjects" / s / "verdict.json" for s in pool.subjects}
    supported = [s for s, path in verdicts.items() if Verdict.read(path).may_be_read]
    measured = read_measured(results, supported, asked["measurement"])
    truth, raw = read_held_out(results, pool.subjects, asked, each)
    return Case(name, pool, asked, measured, truth, pool.standardisation.apply(raw))


def network(case: Case, procedure: str, seed: int, folder: Path) -> TrainedEstimator:
    """Return the network of this seed, trained now if the folder does not hold it."""
    path = folder / f"{case.name}-{procedure}-{seed}.pt"
    if not path.exists():
        settings = case.asked["estimator"].model_copy(update={"procedure": procedure})
        pool = case.pool
        result = train(
            pool.theta, pool.z, pool.components.names, case.asked["prior"], settings, seed, label=path.stem
        )
        result.estimator.write(path, Provenance("", seed=seed))
    return TrainedEstimator.read(path)


def quantities(case: Case, net: TrainedEstimator) -> Iterator[tuple[str, float]]:
    """Yield what the study reports of a network, by name."""
    yield "held-out log q", -float(losses(net, case.truth, case.z).mean())
    yield "best validation loss", net.best_validation_loss
    settings = case.asked["recovery"]
    some = np.linspace(0, len(case.truth) - 1, settings.recordings).astype(int)
    candidates = draw_candidates(net, case.z[some], settings.candidate_draws, seed=1)
    recovered = recover(case.truth[some], candidates, case.asked["prior"], settings)
    for row in score_recovery(recovered, case.asked["prior"], settings):
        if row.nominal == LEVEL:
            yield f"recovery of {row.parameter} (%)", 100 * row.coverage
    for subject in case.supported:
        yield from _subject(case, net, subject)


def _subject(case: Case, net: TrainedEstimator, subject: MeasuredSubject) -> Iterator[tuple[str, float]]:
    observation = subject.observation
    z = case.pool.observed_z(observation.subject)
    draws = draw_candidates(net, z[None], DRAWS, seed=1)[0]
    theta = draws[in_bounds(draws, case.asked["prior"])]
    scores = score_theta(theta[:1000], subject, case.asked["forward_model"], LEVEL).grid
    yield f"{observation.subject} RMSE (kPa)", scores.rmse_kpa
    yield f"{observation.subject} R2", scores.r2
    low, median, high = np.quantile(theta, [0.05, 0.5, 0.95], axis=0)
    for j, name in enumerate(THETA_NAMES):
        yield f"{observation.subject} median {name}", float(median[j])
        yield f"{observation.subject} width {name}", float(high[j] - low[j])


def compare(table: pd.DataFrame) -> pd.DataFrame:
    """Return mean and sd by procedure, and the difference over its standard error (Welch)."""
    rows = {}
    for name, values in table.groupby("quantity", sort=False):
        by = {procedure: part["value"].to_numpy() for procedure, part in values.groupby("procedure")}
        row = {f"{p} {what}": f(v) for p, v in by.items() for what, f in (("mean", np.mean), ("sd", _sd))}
        if {"sbi", "fast"} <= by.keys() and min(len(v) for v in by.values()) > 1:
            error = np.sqrt(sum(_sd(v) ** 2 / len(v) for v in by.values()))
            row["difference / se"] = (by["fast"].mean() - by["sbi"].mean()) / error
        rows[name] = row
    return pd.DataFrame(rows).T


def _sd(values: np.ndarray) -> float:
    return float(np.std(values, ddof=1)) if len(values) > 1 else float("nan")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--config", type=Path, default=Path("config.yaml"))
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder of a finished study")
    parser.add_argument("--networks", type=Path, required=True, help="folder that keeps the networks")
    parser.add_argument("--experiment", default="paper", help="an experiment of kind features")
    parser.add_argument("--recordings", type=int, default=500, help="held-out recordings of each subject")
    parser.add_argument("--procedures", nargs="+", default=get_args(Procedure), choices=get_args(Procedure))
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    return parser.parse_args()


def main() -> None:
    """Train what is missing and print the comparison."""
    arguments = _arguments()
    arguments.networks.mkdir(parents=True, exist_ok=True)
    study = load_study(read_merged(arguments.config), str(arguments.config))
    case = read_case(study, arguments.experiment, arguments.results, arguments.recordings)
    rows = []
    for procedure in arguments.procedures:
        for seed in arguments.seeds:
            net = network(case, procedure, seed, arguments.networks)
            for name, value in quantities(case, net):
                rows.append({"quantity": name, "procedure": procedure, "seed": seed, "value": value})
    print(f"{arguments.experiment}: {len(case.truth)} recordings never seen, seeds {arguments.seeds}")
    print(compare(pd.DataFrame(rows)).to_string(float_format="%.4g"))


if __name__ == "__main__":
    main()
