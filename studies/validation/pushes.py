r"""Hearts of other generators by push trains: does the 90 % interval contain the truth?

    python -m studies.validation.pushes
    python -m studies.validation.pushes --results results --generators a b --number 60 --csv pushes.csv

Needs the network of a population, trained under the shipped configuration. Hearts of the validation's
generators (README.md), of streams of their own, are recorded as `data/virtual_push_trains` is: 34 pushes a
second over 1.8 beats, half of them lost, an error of a tenth of each speed which the recording declares with
a prior. All speeds of a heart share one scale, as in the validation. Each is answered as a free-running
subject outside the study is.

A line a heart, then a row a generator and quantity: how many of the answered, coverage with its 95 %
Clopper-Pearson interval, bias (mean of log median / truth), width (median of log high / low), median
efficiency and the share answered by MCMC. A heart that the network does not answer for is named and counted.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from studies.validation.answers import HeartAnswersSettings, asked_of
from studies.validation.score import Intervals, intervals, truths
from studies.validation.settings import configured
from swesbi.answers.recording import ModelledRecording, modelled_pushes
from swesbi.artefacts.csv import write_csv
from swesbi.base.arrays import FloatArray
from swesbi.config.read import read_merged
from swesbi.config.study import load_study
from swesbi.context import Context
from swesbi.networks.flow.flow import flow_proposal
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.population.settings import in_declared_range
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.importance import NoLikelihoodError
from swesbi.recording.problems import RecordingError
from swesbi.recording.pushes import ingest_pushes
from swesbi.recording.reader import samples_in
from swesbi.recording.settings import NoiseDeclaration
from swesbi.recording.tables.columns import SPEED
from swesbi.recording.tables.frame import table_of_frame
from swesbi.report.tables.validation_outcomes import QUANTITIES
from swesbi.seeds import generator
from swesbi.study.other_network import check_network
from swesbi.study.results import Results, population_files
from swesbi.virtual.hearts.recording import RecordedHeart
from swesbi.virtual.push_trains import ERROR, ERROR_LOG_SD, record_train

STREAM: Final = "pushes"
DECLARED: Final = NoiseDeclaration(cv_fraction=ERROR, cv_log_sd=ERROR_LOG_SD)


@dataclass(frozen=True)
class Answered:
    """One heart's intervals beside its truths, which are NaN where it has none; (q,) each."""

    truth: FloatArray
    found: Intervals
    efficiency: float
    by_mcmc: bool

    @property
    def inside(self) -> FloatArray:
        """1 where the truth lies in its interval, 0 where not, NaN where there is none; (q,)."""
        held = (self.truth >= self.found.low) & (self.truth <= self.found.high)
        return np.where(np.isfinite(self.truth), held, np.nan)


def answers(flow: TrainedFlow, settings: HeartAnswersSettings, seed: int) -> Iterator[Answered]:
    """Yield the answer to each heart; print why there is none to another."""
    for number in range(settings.hearts):
        made = settings.recorded(number, seed)
        subject = made.heart.context.subject
        try:
            if outside := in_declared_range(made.heart.context, settings.population):
                raise ValueError("; ".join(outside))
            answered = answer(flow, made, settings, seed)
        except (ValueError, RecordingError, NoLikelihoodError) as error:
            print(f"{subject:16s}refused: {error}", flush=True)
            continue
        inside = " ".join("-" if np.isnan(each) else str(int(each)) for each in answered.inside)
        print(f"{subject:16s}{answered.efficiency:8.3f}  {inside}", flush=True)
        yield answered


def answer(flow: TrainedFlow, made: RecordedHeart, settings: HeartAnswersSettings, seed: int) -> Answered:
    """Record a heart by a push train and infer it.

    Raises:
        RecordingError: Too few pushes are left.
        NoLikelihoodError: Every simulation fails.
    """
    heart, context = made.heart, made.heart.context
    rng = generator(seed, STREAM, "train", context.subject)
    table = record_train(heart.curve, context, rng)
    table[SPEED] *= np.exp(settings.acquisition.scale_fraction * rng.standard_normal())
    model = recording_of_table(table, context, DECLARED, settings).model
    sizes, of_heart = settings.exact, HeartModel(model)
    exact, _ = exact_posterior(
        of_heart, flow_proposal(flow, model.recording), sizes, seed, STREAM, context.subject
    )
    found = intervals(model, exact.phi, settings.exact.interval)
    return Answered(truths(heart), found, exact.efficiency, exact.sampler == "mcmc")


def recording_of_table(
    table: pd.DataFrame, context: Context, declared: NoiseDeclaration, settings: HeartAnswersSettings
) -> ModelledRecording:
    """Read a table of pushes, as that of any subject, and return the recording with its model.

    Raises:
        RecordingError: It cannot be used.
    """
    quality = settings.recording
    in_memory = table_of_frame(table, context.subject)
    samples = samples_in(in_memory, quality.phases, quality.density_kg_m3)
    observed = ingest_pushes(samples, context, quality, declared)
    return modelled_pushes(observed, settings.model)


def scores(letter: str, answered: Sequence[Answered], refused: int) -> pd.DataFrame:
    """Return a row a quantity."""
    truth, inside = (np.stack([getattr(one, name) for one in answered]) for name in ("truth", "inside"))
    low, median, high = (
        np.stack([getattr(one.found, name) for one in answered]) for name in ("low", "median", "high")
    )
    rows = []
    for j, quantity in enumerate(QUANTITIES):
        held = inside[np.isfinite(inside[:, j]), j]
        if not len(held):
            continue
        sure = binomtest(int(held.sum()), len(held)).proportion_ci(0.95, method="exact")
        rows.append(
            {
                "generator": letter, "quantity": quantity, "n": len(held), "refused": refused,
                "coverage": held.mean(), "coverage_low": sure.low, "coverage_high": sure.high,
                "bias_log": np.nanmean(np.log(median[:, j] / truth[:, j])),
                "width_log": np.median(np.log(high[:, j] / low[:, j])),
                "efficiency": np.median([one.efficiency for one in answered]),
                "by_mcmc": np.mean([one.by_mcmc for one in answered]),
            }
        )  # fmt: skip
    return pd.DataFrame(rows)


def main() -> None:
    """Answer the hearts, and print a line a heart and a row a generator and quantity."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--config", type=Path, default=Path("config.yaml"))
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder of a finished study")
    parser.add_argument("--generators", nargs="+", default=["a", "b"], metavar="LETTER", help="default: a b")
    parser.add_argument("--number", type=int, default=60, help="hearts of each; default: 60")
    parser.add_argument("--csv", type=Path, help="table to write, a row a generator and quantity")
    options = parser.parse_args()
    study = load_study(read_merged(options.config), str(options.config))
    finished = population_files(Results(options.results), configured().experiment)
    flow, tables = TrainedFlow.read(finished.network), []
    for letter in options.generators:
        settings = asked_of(study, letter, options.number, STREAM)
        check_network(finished.network, settings.train_population)
        answered = list(answers(flow, settings, study.config.seed))
        tables.append(scores(letter, answered, options.number - len(answered)))
    table = pd.concat(tables)
    print(table.round(3).to_string(index=False))
    if options.csv:
        write_csv(options.csv, table)


if __name__ == "__main__":
    main()
