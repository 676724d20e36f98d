"""Importance weighting beside MCMC: efficiency, and processor time for the same effective sample size.

    python benchmarks/exact.py
    python benchmarks/exact.py --results results --experiment calibrated --seconds

Reads the recordings, the noise and the network of a finished study. `--seconds` times a further subject's
exact posterior as a user meets it: a process of its own, imports and writing included.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from swesbi.artefacts import Provenance
from swesbi.config.read import read_merged
from swesbi.config.study import load_study
from swesbi.config.view import View
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, speed_model
from swesbi.networks.flow.flow import flow_proposal
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.posterior.adaptive import adapted
from swesbi.posterior.exact import weight_failures
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.importance import k_hat_limit
from swesbi.posterior.mcmc import sample_mcmc, starting_points
from swesbi.posterior.settings import ExactSettings, asking
from swesbi.posterior.subject import posterior_of_subject
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation

SEED = 1
Result = TypeVar("Result")


@dataclass(frozen=True)
class Row:
    """Both ways for one subject; times in seconds of one core."""

    subject: str
    k_hat: float
    efficiency: float
    reliable: bool
    weighting_s: float
    weighted_effective: float
    mcmc_s: float
    mcmc_effective: float
    r_hat: float

    @property
    def ratio(self) -> float:
        """Time of MCMC over time of weighting, for the same effective sample size."""
        return (self.mcmc_s / self.mcmc_effective) / (self.weighting_s / self.weighted_effective)


def timed(work: Callable[[], Result]) -> tuple[Result, float]:
    """Return what ``work`` returns and the processor time it took (s)."""
    begin = time.process_time()
    result = work()
    return result, time.process_time() - begin


def compare(model: SpeedModel, flow: TrainedFlow, settings: ExactSettings) -> Row:
    """Sample one posterior both ways."""
    proposal, heart = flow_proposal(flow, model.recording), HeartModel(model)
    adapted(heart, asking(settings, 20), SEED, proposal)  # compiles and warms up
    weighted, weighting_s = timed(lambda: adapted(heart, settings, SEED, proposal).weighted)
    draws = len(weighted.phi)
    start = starting_points(heart, weighted, settings.mcmc.start_points, np.random.default_rng(SEED))
    sampled, mcmc_s = timed(lambda: sample_mcmc(heart, start, settings.mcmc, SEED))
    return Row(
        subject=model.recording.subject,
        k_hat=weighted.k_hat,
        efficiency=weighted.efficiency,
        reliable=not weight_failures(
            weighted, k_hat_limit(draws, settings.max_k_hat), settings.min_effective_draws
        ),
        weighting_s=weighting_s,
        weighted_effective=weighted.efficiency * draws,
        mcmc_s=mcmc_s,
        mcmc_effective=float(sampled.effective_draws.min()),
        r_hat=float(sampled.r_hat.max()),
    )


def print_rows(rows: list[Row]) -> None:
    """Print the comparison, a line a subject."""
    print(f"{'':8s}{'weighting':^42s}{'MCMC':^30s}{'MCMC / weighting':>18s}")
    print(
        f"{'subject':8s}{'k-hat':>8s}{'efficiency':>12s}{'effective':>11s}{'s':>7s}    "
        f"{'R-hat':>9s}{'effective':>11s}{'s':>7s}{'time, same size':>21s}"
    )
    for row in rows:
        mark = " " if row.reliable else "*"
        print(
            f"{row.subject:8s}{row.k_hat:8.2f}{row.efficiency:12.2f}{row.weighted_effective:11.0f}"
            f"{row.weighting_s:7.2f}{mark}   {row.r_hat:9.4f}{row.mcmc_effective:11.0f}{row.mcmc_s:7.2f}"
            f"{row.ratio:21.1f}"
        )
    print("* the weights fail a criterion, MCMC is what is reported; effective: of the worst parameter")
    median = float(np.median([row.efficiency for row in rows]))
    print(f"median efficiency {median:.2f}; processor time of one core")


def seconds_of_a_subject(subject: str) -> float:
    """Return the wall time (s) of one subject's exact posterior in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, *sys.argv, "--alone", subject, str(Path(folder) / "posterior.h5")]
        begin = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        return time.perf_counter() - begin


def main() -> None:
    """Compare both ways for every subject and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--config", type=Path, default=Path("config.yaml"))
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder of a finished study")
    parser.add_argument("--experiment", default="calibrated", help="an experiment of kind speeds")
    parser.add_argument("--seconds", action="store_true", help="time a process for each subject too")
    parser.add_argument("--alone", nargs=2, metavar=("SUBJECT", "FILE"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    study = load_study(read_merged(arguments.config), str(arguments.config))
    model = SpeedModelSettings.from_plain(View(study, {"experiment": arguments.experiment})["model"])
    exact = study.config.speed_experiments[arguments.experiment].exact
    flow = TrainedFlow.read(arguments.results / arguments.experiment / "flow.h5")
    noise = CohortNoise.read(arguments.results / "cohort" / "noise.h5")

    def observation(subject: str) -> Observation:
        return Observation.read(arguments.results / "cohort" / subject / "observation.h5")

    if arguments.alone:
        subject, path = arguments.alone
        found = posterior_of_subject(observation(subject), noise, flow, model=model, exact=exact, seed=SEED)
        found.write(Path(path), Provenance("", subject, SEED))
        return
    subjects = study.subjects_of(arguments.experiment)
    print_rows([compare(speed_model(observation(name), noise, model), flow, exact) for name in subjects])
    if arguments.seconds:
        for subject in subjects:
            taken = seconds_of_a_subject(subject)
            print(f"{subject}: {taken:.1f} s for its exact posterior, imports and writing included")


if __name__ == "__main__":
    main()
