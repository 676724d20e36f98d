"""Answer subjects outside the pool with the trained network: posterior, certificate, verdict, figures."""

from __future__ import annotations

import argparse
import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from swesbi.config.new_recordings import is_free_running
from swesbi.config.read import parsed, snakemake_options
from swesbi.config.refusals import recording_refusal
from swesbi.config.slices import stage_settings
from swesbi.config.study import Study
from swesbi.study.answer_text import answer_text, free_text, pressures_text
from swesbi.study.answering import (
    EXIT_REFUSED,
    FREE_OUTPUTS,
    OUTPUTS,
    REFERENCE,
    WITH_PRESSURES,
    OtherAnswerError,
    add_answering,
    answer_free_into,
    answer_into,
    check_new_subject,
    check_untouched,
    choose_experiment,
    experiments_to_ask,
    folder_of,
    is_everyones,
    pressures_of,
    study_with,
    trained_for_pushes,
)
from swesbi.study.finished import answering_stage, check_finished, finished_experiment

LOGGER: Final = logging.getLogger("swesbi")
FROM_PRIOR: Final = (
    "{subject} is free-running and {why}: answered from the prior of {experiment} by adaptive importance "
    "sampling"
)
BY_NETWORK: Final = (
    "{subject} is free-running: the network of {experiment}, which takes any set of pushes, answers"
)
TABLE: Final = {"table": "answers.csv", "workbook": "answers.xlsx"}


@dataclass(frozen=True)
class Request:
    """Who is asked about, and how the answer is to be kept.

    Attributes:
        study: With the cohort of the recordings.
        experiments: Those that may answer, the first first.
        out: Folder of the answer, or of the answers of all; None: that of the study.
        force: Whether what lies there may be written over.
        snakemake: What Snakemake is given for the same configuration.
    """

    study: Study
    experiments: tuple[str, ...]
    out: Path | None
    force: bool
    snakemake: str


@dataclass(frozen=True)
class Given:
    """An answer that was given: by which experiment, where it lies, and what to say of the choice."""

    experiment: str
    folder: Path
    note: str


def main(arguments: Sequence[str]) -> int:
    """Run `infer`; return 0 after printing the answer, or 2 if one of all subjects is refused.

    Raises:
        ConfigError: The configuration or the cohort is wrong, or does not have the subject.
        ValueError: The recording cannot be used, or no network can answer for the subject's context.
        OSError: The study has not been run, or the answer cannot be written.
    """
    options = parsed(_parser(), arguments)
    study = study_with(options, **({"reference_fit": True} if options.reference_fit else {}))
    experiments = experiments_to_ask(study, options.experiment)
    command = snakemake_options(options.config, options.overlay)
    request = Request(study, experiments, options.out, options.force, command)
    if options.all:
        return _answer_all(request)
    subject: str = options.subject
    given = _answer(request, subject, options.out)
    print("\n".join(filter(None, [given.note, _text(study, subject, given)])))
    return 0


def _answer(request: Request, subject: str, out: Path | None) -> Given:
    """Answer one subject by the first experiment that can."""
    study = request.study
    for experiment in request.experiments:
        check_new_subject(study, experiment, subject)
    # what is wrong with the file comes before what is missing of a study
    if refusal := recording_refusal(study, subject):
        raise ValueError(refusal)
    if is_free_running(study, subject):
        return _answer_free(request, subject, out)
    experiment, note = choose_experiment(study, subject, request.experiments)
    finished = finished_experiment(study, experiment)
    check_finished(finished, request.snakemake)
    plain = stage_settings(study, answering_stage(study, experiment), experiment=experiment, subject=subject)
    folder = out or folder_of(study, experiment, subject)
    if not request.force:
        check_untouched(folder, study, subject)
    answer_into(folder, study, subject, experiment, plain, finished)
    return Given(experiment, folder, note)


def _answer_free(request: Request, subject: str, out: Path | None) -> Given:
    """Answer a free-running recording by the first network that takes it, or else from the prior."""
    study = request.study
    network, why = trained_for_pushes(study, subject, request.experiments)
    experiment = network or request.experiments[0]
    folder = out or folder_of(study, experiment, subject)
    if not request.force:
        check_untouched(folder, study, subject)
    answer_free_into(folder, study, subject, experiment, by_network=bool(network))
    note = (BY_NETWORK if network else FROM_PRIOR).format(subject=subject, experiment=experiment, why=why)
    return Given(experiment, folder, note)


def _answer_all(request: Request) -> int:
    """Answer every subject of the cohort, one after the other, and write the table; no refusal stops it."""
    study = request.study
    if not request.force:
        check_table(_tables(request)["table"], (*study.new_rows, *study.new_refused))
    given: dict[str, Given] = {}
    refused = dict(study.new_refused)
    for subject in study.new_rows:
        try:
            given[subject] = _answer(request, subject, request.out / subject if request.out else None)
        except (ValueError, ArithmeticError, RuntimeError) as error:
            if is_everyones(error):
                raise
            refused[subject] = str(error)
            LOGGER.warning("subject %s is refused", subject)
        else:
            print("\n".join(filter(None, [given[subject].note, _text(study, subject, given[subject])])))
    paths = _write_table(request, given, refused)
    print(f"\n{len(given)} answered, {len(refused)} refused; {paths['table'].resolve()}, .xlsx")
    for subject, reason in refused.items():
        print(f"refused: {subject}: {reason}")
    return EXIT_REFUSED if refused else 0


def check_table(path: Path, subjects: Sequence[str]) -> None:
    """Refuse to write over a table with other subjects: that of another folder of the same name.

    Raises:
        OtherAnswerError: Names them.
    """
    from swesbi.report.answers_table import read_answers

    answered = list(read_answers(path)["subject"]) if path.is_file() else []
    others = dict.fromkeys(name for name in answered if name not in subjects)
    if others:
        raise OtherAnswerError(
            f"{path}: has the answers of {', '.join(others)}, who are not in this cohort; name another "
            "folder by --out, or write over it by --force"
        )


def _tables(request: Request) -> dict[str, Path]:
    folder = request.out or Path(request.study.config.results) / "new" / request.study.new_cohort_name
    return {name: folder / file for name, file in TABLE.items()}


def _write_table(
    request: Request, given: Mapping[str, Given], refused: Mapping[str, str]
) -> Mapping[str, Path]:
    """Write ``answers.csv`` and ``answers.xlsx``, the subjects in the order of the cohort."""
    from swesbi.report.answers_table import Asked, answers_table, write_answers
    from swesbi.verdict.answers import read_answer

    study = request.study
    paths = _tables(request)
    rows = []
    for subject in (*study.new_rows, *study.new_refused):
        if subject in given:
            experiment, made = given[subject].experiment, given[subject].folder
            rows.append(Asked(subject, experiment, read_answer(made / OUTPUTS["verdict"])))
        else:
            asked = ", ".join(request.experiments)
            rows.append(Asked(subject, asked, None, refused[subject]))
    write_answers(answers_table(rows), paths["table"], paths["workbook"])
    return paths


def _text(study: Study, subject: str, given: Given) -> str:
    from swesbi.posterior.result import read_exact_result
    from swesbi.recording.free_observation import read_free_observation
    from swesbi.verdict.verdict import read_verdict

    prior = study.config.speed_experiments[study.config.base_of(given.experiment)]
    bounds = (*study.config.priors[prior.prior].parameters, prior.passive_stiffness_kpa)
    result, folder = read_exact_result(given.folder / OUTPUTS["posterior"]), given.folder
    answer = [answer_text(subject, result, read_verdict(folder / OUTPUTS["verdict"]), bounds)]
    if is_free_running(study, subject):
        answer.append(free_text(read_free_observation(folder / FREE_OUTPUTS["observation"])))
        return "\n".join([*answer, f"written to {folder.resolve()}: {', '.join(FREE_OUTPUTS.values())}"])
    written = [*OUTPUTS.values(), *(REFERENCE.values() if study.config.new_subjects.reference_fit else ())]
    for clinical in pressures_of(study, subject):
        answer.append(pressures_text(clinical, read_exact_result(folder / WITH_PRESSURES), bounds))
        written.append(WITH_PRESSURES)
    return "\n".join([*answer, f"written to {folder.resolve()}: {', '.join(written)}"])


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="swesbi infer",
        description="Answer subjects who are not in the study's cohort with the network that the study has "
        "trained: exact posterior with its certificate, verdict, figures, in seconds and without training. "
        "A heart unlike those that it was trained on is answered by the network of a population, if one runs "
        "and knows it, and else refused, with the reason. A free-running recording is answered by the "
        "network of a population, or, where none is trained that knows such a heart, from the prior on. The "
        "configuration is that of the study.",
        epilog="Exit code: 0 answered; 2 refused, or one of --all was: the others are answered all the same.",
    )
    parser.add_argument("--cohort", type=Path, required=True, help="folder with the recordings")
    asked = parser.add_mutually_exclusive_group(required=True)
    asked.add_argument("--subject", help="which of its subjects")
    asked.add_argument(
        "--all",
        action="store_true",
        help="all of them, with answers.csv and answers.xlsx in <results>/new/<cohort>/ or in --out",
    )
    add_answering(parser, "<results>/<experiment>/new/<cohort>/<subject>")
    parser.add_argument("--force", action="store_true", help="write over the answer to another recording")
    parser.add_argument(
        "--reference-fit", action="store_true", help="make a CMA-ES fit to draw beside it, in some 8 s more"
    )
    return parser
