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
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from studies.validation.answers import HeartAnswersSettings, asked_of, scored
from studies.validation.hearts.recording import RecordedHeart
from studies.validation.score import HeartAnswer, refusal
from studies.validation.settings import configured
from studies.validation.table import logs, rate
from swesbi.answers.recording import ModelledRecording, modelled_pushes
from swesbi.artefacts.csv import write_csv
from swesbi.config.read import read_merged
from swesbi.config.study import load_study
from swesbi.context import Context
from swesbi.networks.flow.trained import TrainedFlow, flow_proposal
from swesbi.population.settings import in_declared_range
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.importance import NoLikelihoodError
from swesbi.recording.ingest import ingest_pushes
from swesbi.recording.problems import RecordingError
from swesbi.recording.reader import samples_in
from swesbi.recording.settings import NoiseDeclaration
from swesbi.recording.tables.files import table_of_frame
from swesbi.recording.tables.layout import SPEED
from swesbi.report.tables.validation import QUANTITIES
from swesbi.seeds import generator
from swesbi.study.results import check_network, population_files
from swesbi.verdict.summary import REFUSED
from swesbi.virtual.push_trains import ERROR, ERROR_LOG_SD, record_train

STREAM: Final = "pushes"
CONFIDENCE: Final = 0.95
DECLARED: Final = NoiseDeclaration(cv_fraction=ERROR, cv_log_sd=ERROR_LOG_SD)


def answers(flow: TrainedFlow, settings: HeartAnswersSettings, seed: int) -> Iterator[HeartAnswer]:
    """Yield the answer to each heart, and print a line; one to which there is none is refused."""
    for number in range(settings.hearts):
        made = settings.recorded(number, seed)
        subject = made.heart.context.subject
        try:
            if outside := in_declared_range(made.heart.context, settings.population):
                raise ValueError("; ".join(outside))
            found = answer(flow, made, number, settings, seed)
        except (ValueError, RecordingError, NoLikelihoodError) as error:
            print(f"{subject:16s}refused: {error}", flush=True)
            yield refusal(number, made.heart, made.redrawn, str(error))
            continue
        inside = " ".join(np.where(found.asked, found.covered.astype(int).astype(str), "-"))
        print(f"{subject:16s}{found.efficiency:8.3f}  {inside}", flush=True)
        yield found


def answer(
    flow: TrainedFlow, made: RecordedHeart, number: int, settings: HeartAnswersSettings, seed: int
) -> HeartAnswer:
    """Record a heart by a push train and infer it; there is no verdict."""
    heart = made.heart
    context = heart.context
    rng = generator(seed, STREAM, "train", context.subject)
    table = record_train(heart.curve, context, rng)
    table[SPEED] *= np.exp(settings.acquisition.scale_fraction * rng.standard_normal())
    model = recording_of_table(table, context, DECLARED, settings).model
    exact, _ = exact_posterior(
        HeartModel(model), flow_proposal(flow, model.recording), settings.exact, seed, STREAM, context.subject
    )
    return scored(made, model, exact, number, "", "")


def recording_of_table(
    table: pd.DataFrame, context: Context, declared: NoiseDeclaration, settings: HeartAnswersSettings
) -> ModelledRecording:
    """Read a table of pushes, as that of any subject, and return the recording with its model."""
    quality = settings.recording
    in_memory = table_of_frame(table, context.subject)
    samples = samples_in(in_memory, quality.phases, quality.density_kg_m3)
    observed = ingest_pushes(samples, context, quality, declared)
    return modelled_pushes(observed, settings.model)


def scores(letter: str, answers: Sequence[HeartAnswer]) -> pd.DataFrame:
    """Return a row a quantity that the hearts have."""
    answered = [one for one in answers if one.status != REFUSED]
    of_all = {
        "efficiency": np.median([one.efficiency for one in answered]),
        "by_mcmc": np.mean([one.by_mcmc for one in answered]),
    }
    rows = []
    for column, quantity in enumerate(QUANTITIES):
        asked = [one for one in answered if one.asked[column]]
        if not asked:
            continue
        coverage = rate([one.covered[column] for one in asked], CONFIDENCE)
        names = ("coverage", "coverage_low", "coverage_high")
        of_quantity = dict(zip(names, coverage, strict=True)) | logs(asked, column)
        of_quantity.pop("width_log_scale_fixed")
        counted = {"n": len(asked), "refused": len(answers) - len(answered)}
        rows.append({"generator": letter, "quantity": quantity} | counted | of_quantity | of_all)
    return pd.DataFrame(rows)


def main() -> None:
    """Answer the hearts, and print a line a heart and a row a generator and quantity."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder of a finished study")
    parser.add_argument("--generators", nargs="+", default=["a", "b"], metavar="LETTER", help="default: a b")
    parser.add_argument("--number", type=int, default=60, help="hearts of each; default: 60")
    parser.add_argument("--csv", type=Path, help="table to write, a row a generator and quantity")
    options = parser.parse_args()
    study = load_study(read_merged(Path("config.yaml")))
    finished = population_files(options.results, configured().experiment)
    flow, tables = TrainedFlow.read(finished.network), []
    for letter in options.generators:
        settings = asked_of(study, letter, options.number, STREAM)
        check_network(finished.network, settings.train_population)
        tables.append(scores(letter, list(answers(flow, settings, study.config.seed))))
    table = pd.concat(tables)
    print(table.round(3).to_string(index=False))
    if options.csv:
        write_csv(options.csv, table)


if __name__ == "__main__":
    main()
