"""One recording inferred by this project and by its peers, and one beat simulated by each, in one run.

    python benchmarks/peers.py
    python benchmarks/peers.py --physioblocks /path/to/python
    python benchmarks/peers.py --table docs/tables/peers.csv

All infer the shipped recording of G under one likelihood: this project with its network and without, emcee by
its own moves, until 2,000 draws are effective. sbi's NPE draws 2,000 after a training of its own on simulated
recordings of G. The judge is a classifier between 2,000 draws of each and of long chains: 0.5 is equal.
PhysioBlocks is optional and pins other versions than this project, so it runs in an environment of its own.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import emcee
import numpy as np
import pandas as pd
import torch
from cases import converged_beats, load_cases
from numpy.typing import NDArray
from sbi.inference import NPE
from simulator import physioblocks, scipy_lsoda, this_model

from swesbi.base.workers import LIMIT
from swesbi.checks.calibration.local import classifier_accuracy
from swesbi.config.read import read_merged
from swesbi.config.study import Study, load_study
from swesbi.measurement.likelihood import draw_speeds
from swesbi.measurement.speeds import WallPhases
from swesbi.networks.flow.trained import FlowProposal
from swesbi.networks.torch_prior import torch_prior
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.mcmc import sample_mcmc
from swesbi.posterior.settings import ExactSettings, McmcSettings
from swesbi.posterior.space import LogitSpace, log_posterior_in
from swesbi.prior import draw_prior
from swesbi.study.answerer import Answerer, experiments_to_ask

Array = NDArray[np.float64]

ROOT: Final = Path(__file__).parents[1]
COHORT: Final = ROOT / "data" / "virtual_volunteers"
SUBJECT: Final = "G"
DRAWS: Final = 2000
WALKERS: Final = 64
STEPS: Final = 2000  # of emcee, between two looks at its autocorrelation
LONGEST: Final = 50_000
WARM_UP: Final = 5  # autocorrelation times that are left out
TRAINING_DRAWS: Final = 20_000
SEED: Final = 1


@dataclass(frozen=True)
class Counted(HeartModel):
    """A model that counts the hearts that it simulates."""

    sizes: list[int] = field(default_factory=list)

    def simulated(self, points: Array) -> tuple[WallPhases, Array]:
        """Simulate the hearts, and count them."""
        self.sizes.append(len(points))
        return super().simulated(points)


@dataclass
class Row:
    """One line of the table; NaN where a number has no meaning."""

    peer: str
    what: str
    wall_s: float = np.nan
    cpu_s: float = np.nan
    simulations: float = np.nan
    effective_draws: float = np.nan
    c2st: float = np.nan
    error_95: float = np.nan
    error_worst: float = np.nan


@contextmanager
def timed(row: Row) -> Iterator[None]:
    """Write wall and processor time of a block into a row."""
    began = time.perf_counter(), time.process_time()
    yield
    row.wall_s, row.cpu_s = time.perf_counter() - began[0], time.process_time() - began[1]


@dataclass(frozen=True)
class Recording:
    """What is inferred: the model of the recording, the network's proposal, and the study's settings."""

    heart: HeartModel
    network: FlowProposal
    exact: ExactSettings
    chains: McmcSettings

    @property
    def counted(self) -> Counted:
        """The model, with nothing counted yet."""
        return Counted(self.heart.speeds)

    def accuracy(self, phi: Array, chains: Array) -> float:
        """Return the accuracy of a classifier between draws (n, d) and those of the long chains (n, d)."""
        return classifier_accuracy(phi, chains, self.heart.prior, SEED)


def read_recording(study: Study) -> Recording:
    """Read the shipped recording under the shipped configuration."""
    asked = Answerer(study, experiments_to_ask(study, None), "").request(SUBJECT)
    model = asked.recording.model
    proposal = asked.knowledge.proposal(model.recording)
    if proposal is None:
        raise ValueError("no network answers the recording; run this in a checkout")
    local = study.config.speed_experiments["calibrated"].calibration.local
    chains = local.mcmc.model_copy(update={"min_effective_draws": 2 * DRAWS})
    return Recording(HeartModel(model), proposal, asked.settings.exact, chains)


def long_chains(recording: Recording) -> Array:
    """Return draws (n, d) of long chains of this project, with twice as many effective draws."""
    first, _ = exact_posterior(recording.heart, recording.network, recording.exact, SEED, "start")
    rng = np.random.default_rng(SEED)
    start = recording.heart.points(first.phi[rng.permutation(len(first.phi))])
    start = np.unique(start, axis=0)[: recording.chains.start_points]
    chains = sample_mcmc(recording.heart, start, recording.chains, SEED, recording.network)
    if not chains.converged:
        raise RuntimeError("the long chains have not converged")
    return recording.heart.evaluated(chains.thinned(DRAWS, rng)).phi


def ours(recording: Recording, chains: Array, name: str, network: FlowProposal | None) -> Row:
    """Infer as an answer does, to as many effective draws."""
    model, row = recording.counted, Row(name, f"{DRAWS} effective draws")
    with timed(row):
        exact, drawn = exact_posterior(model, network, recording.exact, SEED, "peers")
    row.simulations = sum(model.sizes)
    row.effective_draws = drawn.weighted.efficiency * len(drawn.weighted.phi)
    row.c2st = recording.accuracy(exact.phi[:DRAWS], chains)
    return row


def by_emcee(recording: Recording, chains: Array) -> Row:
    """Sample the logit of the parameters from draws of the prior on, by emcee's own moves."""
    model, rng = recording.counted, np.random.default_rng(SEED)
    space, row = (
        LogitSpace(model.settings.prior),
        Row(f"emcee {version('emcee')}", f"{DRAWS} effective draws"),
    )

    def log_posterior(u: Array) -> Array:
        return log_posterior_in(space, model, u)

    with timed(row):
        start = space.place(draw_prior(model.settings.prior, 10 * WALKERS, rng))[0]
        start = start[np.isfinite(log_posterior(start))][:WALKERS]
        sampler = emcee.EnsembleSampler(*start.shape, log_posterior, vectorize=True)
        sampler.random_state = np.random.RandomState(SEED).get_state()
        state: Any = start
        while sampler.iteration < LONGEST:
            state = sampler.run_mcmc(state, STEPS)
            apart = float(sampler.get_autocorr_time(tol=0).max())
            warm_up = int(WARM_UP * apart)
            row.effective_draws = WALKERS * max(sampler.iteration - warm_up, 0) / apart
            if row.effective_draws >= DRAWS:
                break
        u = sampler.get_chain(discard=warm_up, flat=True)
        phi = model.evaluated(space.at(u[rng.choice(len(u), DRAWS, replace=False)])).phi
    row.simulations, row.c2st = sum(model.sizes), recording.accuracy(phi, chains)
    return row


def by_npe(recording: Recording, chains: Array) -> list[Row]:
    """Train sbi's NPE, as it is installed, on recordings of this heart and draw from it."""
    speeds = recording.heart.speeds
    prior, rng = speeds.settings.prior, np.random.default_rng(SEED)
    name = f"NPE of sbi {version('sbi')}"
    training, sampling = Row(name, "training"), Row(name, f"{DRAWS} draws")
    torch.manual_seed(SEED)
    with timed(training):
        phi = draw_prior(prior, TRAINING_DRAWS, rng)
        errors, missed = speeds.recording.errors, speeds.settings.discrepancy
        x = np.log(draw_speeds(speeds.predict(phi), errors, missed, rng))
        good = np.isfinite(x).all(axis=1)
        inference = NPE(prior=torch_prior(prior), show_progress_bars=False)
        inference.append_simulations(_single(phi[good]), _single(x[good])).train()
        posterior = inference.build_posterior()
    training.simulations = TRAINING_DRAWS
    with timed(sampling):
        seen = _single(np.log(speeds.recording.speed_m_s)[None])
        drawn = posterior.sample((DRAWS,), x=seen, show_progress_bars=False).numpy().astype(np.float64)
    sampling.simulations, sampling.effective_draws = 0, DRAWS
    sampling.c2st = recording.accuracy(drawn, chains)
    return [training, sampling]


def _single(values: Array) -> torch.Tensor:
    return torch.from_numpy(values.astype(np.float32))


def simulators(python: str, draws: int) -> list[Row]:
    """Return the time of a simulation to its periodic beat, with its error, by each program."""
    cases = load_cases(draws)
    exact = converged_beats(cases)
    found = [this_model(cases, exact), scipy_lsoda(cases, exact, draws=3), physioblocks(python, beats=3)]
    return [
        Row(
            each.name,
            each.what,
            cpu_s=each.seconds,
            simulations=1,
            error_95=each.error_95,
            error_worst=each.error_worst,
        )
        for each in found
        if each is not None
    ]


def main() -> None:
    """Run everything on one thread and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--physioblocks", default=sys.executable, help="interpreter that has physioblocks")
    parser.add_argument("--draws", type=int, default=1000, help="prior draws a subject, of the simulators")
    parser.add_argument("--table", type=Path, help="CSV to write")
    arguments = parser.parse_args()
    os.environ[LIMIT] = "1"
    torch.set_num_threads(1)
    recording = read_recording(load_study(read_merged(ROOT / "config.yaml"), new_cohort=COHORT))
    recording.heart.log_likelihood(draw_prior(recording.heart.settings.prior, 8, np.random.default_rng(0)))
    chains = long_chains(recording)
    runs: list[Callable[[], list[Row]]] = [
        lambda: [ours(recording, chains, "swesbi, from its network", recording.network)],
        lambda: [ours(recording, chains, "swesbi, from the prior", None)],
        lambda: [by_emcee(recording, chains)],
        lambda: by_npe(recording, chains),
        lambda: simulators(arguments.physioblocks, arguments.draws),
    ]
    rows = []
    for run in runs:
        rows += run()
        print(pd.DataFrame([asdict(rows[-1])]).to_string(index=False, header=False), flush=True)
    table = pd.DataFrame([asdict(row) for row in rows])
    print(table.to_string(index=False, float_format="%.4g"))
    if arguments.table:
        table.to_csv(arguments.table, index=False, float_format="%.4g", lineterminator="\n")


if __name__ == "__main__":
    main()
