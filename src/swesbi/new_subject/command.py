"""Answer a subject outside the pool with the trained network: posterior, certificate, verdict, figures."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, get_type_hints

from swesbi.config import ConfigError, Study, add_options, load_study, overlay, read_merged, snakemake_options
from swesbi.config.slices import stage_settings
from swesbi.new_subject.files import (
    OUTPUTS,
    FinishedPopulation,
    FinishedStudy,
    check_finished,
    finished_population,
    finished_study,
)
from swesbi.stages.origin import Origin
from swesbi.stages.registry import stage_code, stage_function


def main(arguments: Sequence[str]) -> int:
    """Run `new-subject`; return 0 after printing the answer.

    Raises:
        ConfigError: The configuration or the cohort is wrong, or does not have the subject.
        ValueError: The recording cannot be used, or the network cannot answer for the subject's context.
        OSError: The study has not been run, or the answer cannot be written.
    """
    options = _parser().parse_args(arguments)
    study = _study(options)
    experiment = options.experiment or _experiment(study)
    subject: str = options.subject
    _check_subject(study, subject)
    results = Path(study.config.results)
    over_population = experiment in study.config.population_experiments
    stage = "new_subject_of_population" if over_population else "new_subject"
    # an experiment that cannot answer is named before anything is looked for under its name
    plain = stage_settings(study, stage, experiment=experiment, subject=subject)
    finished = (
        finished_population(results, experiment)
        if over_population
        else finished_study(results, experiment, study.subjects)
    )
    check_finished(finished, snakemake_options(options.config, options.overlay))
    folder = options.out or results / experiment / "new" / subject
    _answer(study, subject, stage, plain, finished, folder)
    print(_text(study, experiment, subject, folder))
    return 0


def _answer(
    study: Study,
    subject: str,
    stage: str,
    plain: Mapping[str, Any],
    finished: FinishedStudy | FinishedPopulation,
    folder: Path,
) -> None:
    """Run the stage and put what it made into ``folder``, all of it or nothing."""
    # torch and matplotlib take seconds to import; what is refused above should not wait for them
    run = stage_function(stage)
    settings = get_type_hints(run)["settings"].from_plain(plain)
    # a refused subject leaves no folder behind
    existing = next(path for path in folder.absolute().parents if path.is_dir())
    with tempfile.TemporaryDirectory(prefix=f".{subject}-", dir=existing) as made:
        outputs = {name: Path(made) / file for name, file in OUTPUTS.items()}
        run(
            recording=study.new_recording(subject),
            **vars(finished),
            **outputs,
            settings=settings,
            origin=Origin(study.config.seed, subject, stage_code(stage)),
        )
        folder.mkdir(parents=True, exist_ok=True)
        for path in outputs.values():
            path.replace(folder / path.name)


def _text(study: Study, experiment: str, subject: str, folder: Path) -> str:
    from swesbi.evaluation.exact_result import read_exact_result
    from swesbi.inference.support import read_support
    from swesbi.new_subject.answer import answer_text

    prior = study.config.speed_experiments[study.config.base_of(experiment)]
    bounds = (*study.config.priors[prior.prior].parameters, prior.passive_scale_kpa)
    result = read_exact_result(folder / OUTPUTS["posterior"])
    answer = answer_text(subject, result, read_support(folder / OUTPUTS["support"]), bounds)
    return f"{answer}\nwritten to {folder}: {', '.join(OUTPUTS.values())}"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m swesbi new-subject",
        description="Answer a subject who is not in the study's cohort with the network that the study has "
        "trained: exact posterior with its certificate, verdict, figures, in seconds and without training. "
        "A subject whose heart is unlike those that it was trained on is refused, with the reason. The "
        "configuration is that of the study.",
    )
    parser.add_argument("--cohort", type=Path, required=True, help="folder with the subject's recording")
    parser.add_argument("--subject", required=True, help="which of its subjects")
    parser.add_argument("--phases", type=int, help="gated phases of the recording; default: as configured")
    parser.add_argument(
        "--experiment", help="default: the first of kind speeds that runs; or one over a population"
    )
    parser.add_argument("--out", type=Path, help="folder; default: <results>/<experiment>/new/<subject>")
    add_options(parser)
    return parser


def _study(options: argparse.Namespace) -> Study:
    raw = read_merged(options.config, options.overlay)
    chosen: dict[str, object] = {"cohort": str(options.cohort)}
    if options.phases is not None:
        chosen["phases"] = options.phases
    return load_study(overlay(raw, {"new_subjects": chosen}), str(options.config))


def _experiment(study: Study) -> str:
    running = [name for name in study.config.experiments_run if name in study.config.speed_experiments]
    running += study.config.populations_run
    if not running:
        raise ConfigError(
            "run: no experiment of kind speeds or over a population runs, and no other answers a new subject"
        )
    return running[0]


def _check_subject(study: Study, subject: str) -> None:
    cohort = Path(str(study.config.new_subjects.cohort))
    if subject not in study.new_rows:
        raise ConfigError(f"subject = {subject!r}: {cohort} has {', '.join(study.new_rows)}")
    if cohort.resolve() == study.cohort.resolve() and subject in study.subjects:
        raise ConfigError(
            f"subject = {subject!r}: is in the cohort that the network was trained on; its answer is in "
            f"{study.config.results}/<experiment>/subjects/{subject}/"
        )
