r"""Whether answers to hearts that the network has not seen are those of long Markov chains, in all of phi.

    python -m studies.validation.long_chains
    python -m studies.validation.long_chains --results results --subjects 20 --generator b \
        --stream development --csv long_chains.csv

Needs a finished study of the shipped configuration. Hearts of streams of development
(README.md), none of the validation itself, are recorded as it records them and answered as a subject
outside the study is: draws of the population's network, refined and weighted, MCMC where the weights fail.
Long chains on the same posterior, under `calibration.local.mcmc`, run until they have twice as many effective
draws as a classifier sees (`calibration.local.two_sample_draws`), so that these are as good as independent.
The classifier then tells the two apart by all parameters, nuisances included: 0.5 means that it cannot.

A line a heart, printed when it is done: how efficient the network's draws and the answer's are, what gave the
answer, R-hat of the long chains, C2ST, processor time of one core both ways. C2ST is `nan` where the chains
did not converge. A heart that the network does not answer for is named and left out. A heart takes some
minutes, nearly all of it the long chains.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final, TypeVar

import numpy as np
import pandas as pd

from studies.validation.answers import HeartAnswersSettings, asked_of
from studies.validation.settings import configured
from swesbi.answers.recording import ModelledRecording
from swesbi.artefacts.csv import write_csv
from swesbi.checks.calibration.local import classifier_accuracy
from swesbi.checks.calibration.settings import LocalSettings
from swesbi.config.read import read_merged
from swesbi.config.study import Study, load_study
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import measured_speeds
from swesbi.networks.flow.files import load_flow
from swesbi.networks.flow.flow import TrainedFlow, flow_proposal
from swesbi.population.settings import in_declared_range
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.importance import NoLikelihoodError
from swesbi.posterior.mcmc import McmcDraws, sample_mcmc, starting_points
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.noise.cohort import read_noise
from swesbi.recording.speed import NoiseComponents
from swesbi.seeds import generator, integer_seed
from swesbi.study.finished import FinishedPopulation, check_finished, finished_population
from swesbi.study.other_network import check_network
from swesbi.virtual.hearts.recorded import VALIDATION_STREAM

STREAM: Final = "long chains"
Result = TypeVar("Result")


@dataclass(frozen=True)
class Row:
    """One heart both ways; times in seconds of one core."""

    subject: str
    network_efficiency: float
    efficiency: float
    sampler: str
    answer_s: float
    r_hat: float
    chains_s: float
    c2st: float

    def line(self) -> str:
        """Return the row as :data:`HEAD` has it."""
        return (
            f"{self.subject:24s}{self.network_efficiency:9.3f}{self.efficiency:12.3f}  {self.sampler:12s}"
            f"{self.r_hat:8.4f}{self.c2st:8.3f}{self.answer_s:10.1f}{self.chains_s:10.1f}"
        )


HEAD: Final = (
    f"{'heart':24s}{'network':>9s}{'efficiency':>12s}  {'sampler':12s}{'R-hat':>8s}{'C2ST':>8s}"
    f"{'answer s':>10s}{'chains s':>10s}"
)


@dataclass(frozen=True)
class Answerer:
    """What answers a heart and what the answer is compared with.

    Attributes:
        flow: The population's network.
        noise: Noise of the study's cohort, from which standard errors are estimated.
        settings: Of the hearts and of their answers.
        local: Long chains, and how many draws the classifier sees.
        seed: The study's seed.
    """

    flow: TrainedFlow
    noise: NoiseComponents
    settings: HeartAnswersSettings
    local: LocalSettings
    seed: int

    def rows(self) -> Iterator[Row]:
        """Yield a row for each heart that the network answers for; print why it does not for another."""
        settings = self.settings
        for number in range(settings.hearts):
            made = settings.recorded(number, self.seed)
            context = made.heart.context
            if outside := in_declared_range(context, settings.population):
                print(f"{context.subject:24s}refused: {'; '.join(outside)}", flush=True)
                continue
            recording = measured_speeds(made.observation, self.noise)
            try:
                row = self.row(SpeedModel(recording, settings.exact_posterior.model))
            except NoLikelihoodError as error:
                print(f"{context.subject:24s}refused: {error}", flush=True)
            else:
                yield row

    def row(self, model: SpeedModel) -> Row:
        """Sample one posterior both ways, and let the classifier tell them apart."""
        subject, prior, draws = model.recording.subject, model.settings.prior, self.local.two_sample_draws
        (exact, efficiency), answer_s = timed(lambda: self._answered(model))
        chains, chains_s = timed(lambda: self._long_chains(model, exact))
        c2st = float("nan")
        if chains.converged:
            kept = chains.thinned(draws, generator(self.seed, STREAM, "thinned", subject))
            phi = HeartModel(model).evaluated(kept).phi
            stream = integer_seed(self.seed, STREAM, "c2st", subject)
            c2st = classifier_accuracy(exact.phi[:draws], phi, prior, stream)
        return Row(
            subject, efficiency[0], exact.efficiency, exact.sampler, answer_s, float(chains.r_hat.max()),
            chains_s, c2st,
        )  # fmt: skip

    def _answered(self, model: SpeedModel) -> tuple[ExactPosterior, tuple[float, ...]]:
        network, exact = flow_proposal(self.flow, model.recording), self.settings.exact_posterior.exact
        return exact_posterior(
            HeartModel(model), network, exact, self.seed, ModelledRecording.stream, model.recording.subject
        )

    def _long_chains(self, model: SpeedModel, exact: ExactPosterior) -> McmcDraws:
        mcmc, subject = self.local.mcmc, model.recording.subject
        rng = generator(self.seed, STREAM, "start", subject)
        heart = HeartModel(model)
        start = starting_points(heart, exact.weighted, mcmc.start_points, rng)
        stream = integer_seed(self.seed, STREAM, "mcmc", subject)
        # as `reference_draws` does it, but a heart whose chains do not converge ends no run
        least = 2 * self.local.two_sample_draws
        network = flow_proposal(self.flow, model.recording)
        return sample_mcmc(heart, start, mcmc, stream, least_effective=least, space=network)


def timed(work: Callable[[], Result]) -> tuple[Result, float]:
    """Return what ``work`` returns and the processor time it took (s)."""
    begin = time.process_time()
    result = work()
    return result, time.process_time() - begin


def answerer(study: Study, finished: FinishedPopulation, options: argparse.Namespace) -> Answerer:
    """Return what answers the hearts that are asked for.

    Raises:
        OtherNetworkError: The network was trained under other settings.
        ArtefactError: A file is no such artefact.
    """
    settings = asked_of(study, options.generator, options.subjects, options.stream)
    check_network(finished.estimator, settings.train_population.to_plain())
    base = study.config.base_of(configured().experiment)
    local = study.config.speed_experiments[base].calibration.local
    flow, noise = load_flow(finished.estimator)[0], read_noise(finished.noise).usual
    return Answerer(flow, noise, settings, local, study.config.seed)


def summary(rows: list[Row]) -> str:
    """Return what the rows come to, in a line."""
    accuracy = np.array([row.c2st for row in rows])
    compared = accuracy[np.isfinite(accuracy)]
    efficiency = np.median([row.efficiency for row in rows])
    by_mcmc = np.mean([row.sampler == "mcmc" for row in rows])
    told = f"C2ST {compared.mean():.3f} in the mean, {compared.max():.3f} at most" if len(compared) else ""
    return (
        f"{len(compared)} of {len(rows)} hearts compared: {told or 'no long chains converged'}; "
        f"median efficiency {efficiency:.3f}; by MCMC {by_mcmc:.0%}"
    )


def main() -> None:
    """Answer the hearts both ways, and print a line a heart and what they come to."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--config", type=Path, default=Path("config.yaml"))
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder of a finished study")
    parser.add_argument("--subjects", type=int, default=20, help="how many hearts; default: 20")
    parser.add_argument("--generator", default="b", metavar="LETTER", help="whose hearts; default: b")
    parser.add_argument("--stream", default="development", help="name of their random streams")
    parser.add_argument("--csv", type=Path, help="table to write, a row a heart")
    options = parser.parse_args()
    if options.stream == VALIDATION_STREAM:
        parser.error(f"--stream {VALIDATION_STREAM}: those are for the validation; take any other name")
    study = load_study(read_merged(options.config), str(options.config))
    finished = finished_population(options.results, configured().experiment)
    check_finished(finished)
    print(HEAD, flush=True)
    rows = []
    for row in answerer(study, finished, options).rows():
        print(row.line(), flush=True)
        rows.append(row)
    if not rows:
        raise SystemExit("the network answers for none of these hearts")
    print(summary(rows))
    if options.csv:
        write_csv(options.csv, pd.DataFrame([asdict(row) for row in rows]))


if __name__ == "__main__":
    main()
