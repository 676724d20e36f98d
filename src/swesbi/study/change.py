"""Answer two visits of one person outside the study, and say what has changed between them."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, get_type_hints

from swesbi.artefacts import folder_made_whole
from swesbi.config.pairs import VisitPair, visit_pair
from swesbi.config.read import ConfigError, parsed, snakemake_options
from swesbi.config.slices import stage_settings
from swesbi.config.study import Study
from swesbi.recording.visits import Visit
from swesbi.study.answering import (
    OUTPUTS,
    add_answering,
    answer_into,
    check_new_subject,
    experiments_to_ask,
    study_with,
)
from swesbi.study.finished import (
    FinishedPopulation,
    FinishedStudy,
    answering_stage,
    check_finished,
    finished_experiment,
)
from swesbi.study.registry import file_arguments, stage_code, stage_function
from swesbi.study.stages.origin import Origin

STAGE: Final = "person_change"
CHANGE_OUTPUTS: Final = {
    "joint": "change.h5",
    "table": "change.csv",
    "figure_pdf": "change.pdf",
    "figure_png": "change.png",
    "sheet": "sheet.pdf",
}


@dataclass(frozen=True)
class Asked:
    """Whose change, by which experiment, with what the study leaves for it."""

    study: Study
    experiment: str
    pair: VisitPair
    finished: FinishedStudy | FinishedPopulation


def main(arguments: Sequence[str]) -> int:
    """Run `change`; return 0 after printing the ratios.

    Raises:
        ConfigError: The configuration or the cohort is wrong, or has no such person or visit, or but one.
        ValueError: A recording cannot be used, or the network cannot answer for its context.
        OSError: The study has not been run, or the answer cannot be written.
    """
    options = parsed(_parser(), arguments)
    study = study_with(options)
    _check_visits(study, options.person)
    experiment = experiments_to_ask(study, options.experiment)[0]
    pair = visit_pair(study, options.person, options.from_visit, options.to_visit)
    for subject in pair.subjects:
        check_new_subject(study, experiment, subject)
    visits = {"from_visit": pair.visits[0], "to_visit": pair.visits[1]}
    plain = stage_settings(study, STAGE, experiment=experiment, person=pair.person, **visits)
    finished = finished_experiment(study, experiment)
    check_finished(finished, snakemake_options(options.config, options.overlay))
    folder = options.out or Path(study.config.results) / experiment / "change" / pair.person
    _answer(folder, Asked(study, experiment, pair, finished), plain)
    print(_text(folder))
    return 0


def _check_visits(study: Study, person: str) -> None:
    """Refuse a person of whom a visit cannot be used: left out, it would make the pair another one.

    A row that cannot be used and names no person may be one of these.

    Raises:
        ConfigError: Lists what is wrong with it.
    """
    whose = {subject: study.new_visit_rows.get(subject, Visit()).person for subject in study.new_refused}
    lost = [study.new_refused[subject] for subject, name in whose.items() if name in ("", person)]
    if lost:
        raise ConfigError("\n".join(lost))


def _answer(folder: Path, asked: Asked, plain: Mapping[str, Any]) -> None:
    """Answer both visits, then the pair, and put all of it into ``folder``, or nothing."""
    with folder_made_whole(folder) as made:
        visits = [
            _visit(made, asked, visit, subject)
            for visit, subject in zip(asked.pair.visits, asked.pair.subjects, strict=True)
        ]
        _compare(made, asked, visits, plain)


def _visit(made: Path, asked: Asked, visit: str, subject: str) -> Path:
    """Answer one visit as `new-subject` does, and return its folder.

    Raises:
        ValueError: It is refused; says which visit.
    """
    folder, stage = made / subject, answering_stage(asked.study, asked.experiment)
    plain = stage_settings(asked.study, stage, experiment=asked.experiment, subject=subject)
    try:
        answer_into(folder, asked.study, subject, asked.experiment, plain, asked.finished)
    except ValueError as error:
        raise ValueError(
            f"visit {visit!r} of {asked.pair.person!r} (recording {subject}): {error}; no change is told"
        ) from error
    return folder


def _compare(made: Path, asked: Asked, visits: Sequence[Path], plain: Mapping[str, Any]) -> None:
    run = stage_function(STAGE)
    answers = {
        "observations": [folder / OUTPUTS["observation"] for folder in visits],
        "posteriors": [folder / OUTPUTS["posterior"] for folder in visits],
        "supports": [folder / OUTPUTS["support"] for folder in visits],
        "protocol": asked.study.new_protocol,
        "pooled_observations": (),
    }
    outputs = {name: made / file for name, file in CHANGE_OUTPUTS.items()}
    run(
        **file_arguments(run, answers | vars(asked.finished) | outputs),
        settings=get_type_hints(run)["settings"].from_plain(plain),
        origin=Origin(asked.study.config.seed, asked.pair.person, stage_code(STAGE)),
    )


def _text(folder: Path) -> str:
    from swesbi.persons.change.stored import read_change
    from swesbi.persons.change.words import change_lines

    lines = change_lines(read_change(folder / CHANGE_OUTPUTS["joint"]))
    return "\n".join([*lines, f"written to {folder}: {', '.join(CHANGE_OUTPUTS.values())}, a folder a visit"])


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="swesbi change",
        description="Say what has changed between two visits of one person who is not in the study's cohort: "
        "ratios of parameters with intervals, from the exact posterior of both recordings, which share what "
        "a person keeps. Rows of subjects.csv of one `person` are the visits. Each is answered as "
        "`new-subject` does; the configuration is that of the study.",
    )
    parser.add_argument("--cohort", type=Path, required=True, help="folder with the person's recordings")
    parser.add_argument("--person", required=True, help="which of its persons")
    parser.add_argument("--from", dest="from_visit", metavar="VISIT", help="default: the first")
    parser.add_argument("--to", dest="to_visit", metavar="VISIT", help="default: the last")
    add_answering(parser, "<results>/<experiment>/change/<person>")
    return parser
