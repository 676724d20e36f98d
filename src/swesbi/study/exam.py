"""Sit the exam by strangers: hearts of other generators, answered by the network of a finished study."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_type_hints

from swesbi.config.read import ConfigError, add_options, in_words, parsed, read_merged, snakemake_options
from swesbi.config.slices import stage_settings
from swesbi.config.study import Study, load_study
from swesbi.exam.settings import COHORT_NOISE, EXAM, NOISE_LEVELS, WITH_PRESSURES, NoiseLevel
from swesbi.study.finished import check_finished, finished_population
from swesbi.study.registry import stage_code, stage_function
from swesbi.study.stages.origin import Origin

ANSWERS, PRESSURES, TABLE = "exam_answers", "exam_pressures", "exam_table"


def main(arguments: Sequence[str]) -> int:
    """Run `exam`; return 0 after printing where the tables are.

    Raises:
        ConfigError: The configuration is wrong, or a letter or a number is.
        ValueError: A generator does not exist, or the network was trained under other settings.
        OSError: The study has not been run, or the answers cannot be written.
        RuntimeError: A heart could not be recorded.
    """
    options = parsed(_parser(), arguments)
    study = load_study(
        read_merged(options.config, options.overlay), in_words(options.config, options.overlay)
    )
    letters = options.generators or [str(letter) for letter in study.config.exam.hearts_of(options.stream)]
    _check(study, options, letters)
    finished = finished_population(Path(study.config.results), options.experiment)
    check_finished(finished, snakemake_options(options.config, options.overlay))
    name = f"{options.stream}_pressures" if options.pressures else options.stream
    main_table = options.out or Path(study.config.results) / "tables" / f"{name}.csv"
    for noise in options.noise or (NOISE_LEVELS[:1] if options.pressures else NOISE_LEVELS):
        answers = [_answered(study, options, letter, noise, vars(finished)) for letter in letters]
        table = _table(main_table, noise)
        _tabulated(study, answers, table, options.pressures)
        print(f"written: {table}, {_samplers(table)}, {_figure(table, '.png')}")
    return 0


def _check(study: Study, options: argparse.Namespace, letters: Sequence[str]) -> None:
    asked = study.config.exam.experiment
    if options.experiment is None:
        options.experiment = asked
    if options.experiment != asked:
        raise ConfigError(f"experiment = {options.experiment!r}: configured is exam.experiment = {asked!r}")
    listed = [str(letter) for letter in study.config.exam.hearts]
    if options.stream == EXAM and (unknown := [letter for letter in letters if letter not in listed]):
        raise ConfigError(f"generators: {unknown[0]!r} does not sit the exam; those are {', '.join(listed)}")
    if options.number is not None and options.number < 1:
        raise ConfigError(f"number = {options.number}: at least one heart is needed")


def _answered(
    study: Study, options: argparse.Namespace, letter: str, noise: NoiseLevel, inputs: dict[str, Any]
) -> Path:
    """Answer the hearts of one generator at a level of noise, and return where."""
    stage = PRESSURES if options.pressures else ANSWERS
    plain = stage_settings(study, stage, generator=letter, stream=options.stream, noise=noise)
    if options.number is not None:
        plain["hearts"] = options.number
    run = stage_function(stage)
    folder = Path(study.config.results, options.experiment, options.stream)
    path = folder / noise / f"{letter}.h5"
    files = {"answers": path}
    if options.pressures:
        files = {"without": path, "answers": folder / f"{noise}_pressures" / path.name}
    run(
        **inputs,
        **files,
        settings=get_type_hints(run)["settings"].from_plain(plain),
        origin=Origin(study.config.seed, "", stage_code(stage)),
        processes=options.cores,
    )
    return files["answers"]


def _tabulated(study: Study, answers: Sequence[Path], table: Path, pressures: bool) -> None:
    run = stage_function(TABLE)
    plain = stage_settings(study, TABLE, **({"pressures": WITH_PRESSURES} if pressures else {}))
    run(
        answers=answers,
        table=table,
        samplers=_samplers(table),
        figure_pdf=_figure(table, ".pdf"),
        figure_png=_figure(table, ".png"),
        settings=get_type_hints(run)["settings"].from_plain(plain),
        origin=Origin(study.config.seed, "", stage_code(TABLE)),
    )


def _table(main_table: Path, noise: NoiseLevel) -> Path:
    """Return where the table of a level of noise lies: the cohort's is the main one."""
    return main_table if noise == COHORT_NOISE else main_table.with_stem(f"{main_table.stem}_{noise}_noise")


def _samplers(table: Path) -> Path:
    return table.with_name(f"{table.stem}_samplers.csv")


def _figure(table: Path, suffix: str) -> Path:
    """Return where the figure lies: beside the table, or among figures where the table is among tables."""
    folder = table.parent.with_name("figures") if table.parent.name == "tables" else table.parent
    return folder / f"{table.stem}{suffix}"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="swesbi exam",
        description="Draw and record hearts of other generators (docs/exam.md) and answer each as "
        "`new-subject` does a subject outside the study. Answers are kept under <results>/<experiment>/, so "
        "that a run that was stopped goes on where it was.",
    )
    parser.add_argument("--experiment", help="the one that answers; default and only choice: as configured")
    parser.add_argument("--generators", nargs="+", metavar="LETTER", help="default: all that are configured")
    parser.add_argument("--number", type=int, help="hearts of each; default: as configured")
    parser.add_argument(
        "--stream",
        default=EXAM,
        help="name of the random streams; others give hearts of development",
    )
    parser.add_argument(
        "--noise",
        nargs="+",
        choices=NOISE_LEVELS,
        help="levels of noise, each with tables of its own; default: all, with pressures the cohort's",
    )
    parser.add_argument(
        "--pressures",
        action="store_true",
        help="answer from speeds and cuff pressures; the speeds alone, whose verdicts stand, come first",
    )
    parser.add_argument("--cores", type=int, default=2, help="hearts side by side; changes no answer")
    parser.add_argument("--out", type=Path, help="main table; default: <results>/tables/exam.csv")
    add_options(parser)
    return parser
