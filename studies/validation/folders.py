r"""Folders whose recordings have another noise than the study's cohort: how well are they answered?

    python -m studies.validation.folders
    python -m studies.validation.folders --results results --hearts 40 --csv folders.csv

Needs the network of a population, trained under the shipped configuration. Hearts of the study's own
generator (a, README.md), of streams of their own, are recorded with so many times its noise between repeats
and samples, a folder for each. Each recording is answered with the noise of its folder, as `swesbi infer`
does. A row a folder and parameter: how many are not contradicted, doubtful and contradicted, and in how many
the 90 % interval contains the truth.

Then the noise test alone: recordings with twice the noise are put, one at a time, into a folder of the
study's noise. A line says how many of them it finds.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from studies.validation.answers import HeartAnswersSettings, asked_of, levels_of, scored
from studies.validation.hearts.recording import RecordedHeart
from studies.validation.settings import configured
from swesbi.answers.answer import Knowledge, answered
from swesbi.answers.recording import ModelledRecording, noise_test
from swesbi.artefacts.csv import write_csv
from swesbi.base.arrays import BoolArray
from swesbi.config.read import read_merged
from swesbi.config.study import Study, load_study
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import measured_speeds
from swesbi.parameters import THETA_NAMES
from swesbi.recording.noise.cohort import FolderRecordings
from swesbi.report.tables.validation import QUANTITIES
from swesbi.study.results import population_files
from swesbi.verdict.verdict import Status

GENERATOR: Final = "a"
TIMES: Final = (0.7, 1.5, 2.0)
LOUD: Final = 2.0


def noisy(settings: HeartAnswersSettings, times: float) -> HeartAnswersSettings:
    """Return the same hearts with so many times the noise between repeats and between samples."""
    own = settings.acquisition
    more = {name: times * getattr(own, name) for name in ("repeat_sd_fraction", "sample_sd_fraction")}
    return settings.model_copy(update={"acquisition": own.model_copy(update=more)})


def folder(settings: HeartAnswersSettings, seed: int) -> dict[str, RecordedHeart]:
    """Draw and record the hearts of a folder, by name."""
    made = (settings.recorded(number, seed) for number in settings.numbers)
    return {one.heart.context.subject: one for one in made}


def answer_folder(
    study: Study, knowledge: Knowledge, settings: HeartAnswersSettings, times: float
) -> list[dict[str, object]]:
    """Answer all recordings of a folder with so many times the study's noise; return a row a parameter."""
    hearts, level = folder(settings, study.config.seed), settings.noise_level
    repeats = {name: levels_of(made.samples, settings, "separate") for name, made in hearts.items()}
    noises = FolderRecordings(repeats, study.config.new_subjects.noise_prior)
    inside, words = list[BoolArray](), list[Status]()
    for name, made in hearts.items():
        noise = noises.noise(name)
        test = noise_test(noises.compared(name), noise.components, "the folder", level)
        model = SpeedModel(measured_speeds(made.observation, noise.components), settings.model)
        recording = ModelledRecording(made.observation, model, (test,), noise.in_words)
        answer = answered(recording, knowledge, settings, study.config.seed)
        status = answer.verdict.status
        inside.append(scored(made, model, answer.posterior, len(inside), status, "").covered)
        words.append(status)
        print(f"{times:g} {name:20s}{answer.verdict.sentence[:90]}", flush=True)
    not_contradicted = sum(word.fits for word in words)
    return [
        {
            "times_noise": times, "quantity": quantity, "recordings": len(words),
            "not_contradicted": not_contradicted, "doubtful": words.count(Status.DOUBTFUL),
            "contradicted": words.count(Status.CONTRADICTED), "inside": int(column.sum()),
        }
        for quantity, column in zip(QUANTITIES, np.stack(inside).T, strict=True)
        if quantity in THETA_NAMES
    ]  # fmt: skip


def found_loud(study: Study, quiet: HeartAnswersSettings, loud: HeartAnswersSettings) -> int:
    """Return how many of the loud recordings the noise test finds in the folder of quiet ones."""
    seed, prior = study.config.seed, study.config.new_subjects.noise_prior
    repeats = {name: levels_of(made.samples, quiet, "separate") for name, made in folder(quiet, seed).items()}
    found = 0
    for name, made in folder(loud, seed).items():
        own = {f"loud {name}": levels_of(made.samples, loud, "separate")}
        result = FolderRecordings(repeats | own, prior).compared(f"loud {name}")
        found += result is not None and result.p_value <= quiet.noise_level
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Answer the folders; print and write the table.

    Raises:
        ConfigError: The configuration has no such experiment.
        FileNotFoundError: The network has not been trained.
    """
    parser = argparse.ArgumentParser(prog="python -m studies.validation.folders", description=__doc__)
    parser.add_argument("--results", type=Path, help="of a finished study; default: as configured")
    parser.add_argument("--hearts", type=int, default=40, help="of a folder")
    parser.add_argument("--csv", type=Path, help="where the table goes")
    options = parser.parse_args(arguments)
    study = load_study(read_merged(Path("config.yaml")))
    results = options.results or Path(study.config.results)
    knowledge = population_files(results, configured().experiment).knowledge()
    asked = {
        times: noisy(asked_of(study, GENERATOR, options.hearts, f"folder {times:g}"), times)
        for times in (1.0, *TIMES)
    }
    rows = [row for times in TIMES for row in answer_folder(study, knowledge, asked[times], times)]
    table = pd.DataFrame(rows)
    print(table.to_string(index=False))
    loud = noisy(asked_of(study, GENERATOR, 50, "loud"), LOUD)
    print(
        f"of 50 recordings with {LOUD:g} times the noise of their folder the test finds "
        f"{found_loud(study, asked[1.0], loud)}"
    )
    if options.csv is not None:
        write_csv(options.csv, table)


if __name__ == "__main__":
    main()
