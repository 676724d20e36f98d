"""Answering subjects outside the study: by which experiment, into which folder, what stays untouched."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from swesbi.answers.answer import Answer, Recording, answered
from swesbi.answers.free import FreeRecording
from swesbi.answers.knowledge import Knowledge
from swesbi.answers.settings import OneAnswerSettings
from swesbi.answers.written import OBSERVATION, save_answer
from swesbi.artefacts import ArtefactError, Origin, folder_made_whole
from swesbi.config.parts import named
from swesbi.config.read import ConfigError, add_options, in_words, merged_files, overlay, read_merged
from swesbi.config.refusals import context_refusal, network_of_pushes, trained_on, why_in_short
from swesbi.config.slices import ONE_ANSWER, stage_settings
from swesbi.config.study import Study, load_study
from swesbi.measurement.instants import free_model
from swesbi.recording.free_observation import FreeObservation
from swesbi.recording.noise import read_noise
from swesbi.study.finished import check_finished, finished_experiment, finished_population
from swesbi.study.observing import observe
from swesbi.study.other_network import OtherNetworkError, check_network, check_quality
from swesbi.study.registry import stage_code

EXIT_REFUSED: Final = 2
"""Of a command that goes on where a subject, or a person, of a folder is refused."""
CODE: Final = "swesbi.answers.answer:answered"
"""What makes an answer: the code whose hash its artefacts keep."""
FROM_PRIOR: Final = (
    "{subject} is free-running and {why}: answered from the prior of {experiment} by adaptive importance "
    "sampling"
)
BY_NETWORK: Final = (
    "{subject} is free-running: the network of {experiment}, which takes any set of pushes, answers"
)


class OtherAnswerError(ValueError):
    """A folder holds the answer to another recording, or something else; it is left as it is."""


def add_answering(parser: argparse.ArgumentParser, folder: str) -> None:
    """Add the options of every command that answers recordings outside the study.

    Args:
        parser: Of the command.
        folder: Where it puts its answer by default, for the help text.
    """
    parser.add_argument("--phases", type=int, help="gated phases of a recording; default: as configured")
    parser.add_argument(
        "--experiment",
        help="default: the first of kind speeds that runs, where it refuses a heart one over a population",
    )
    parser.add_argument("--out", type=Path, help=f"folder; default: {folder}")
    add_options(parser)


def study_with(options: argparse.Namespace) -> Study:
    """Return the study with the cohort of the command's options as that of its new subjects.

    Raises:
        ConfigError: The configuration, or the cohort, cannot be used.
    """
    raw = read_merged(options.config, options.overlay)
    chosen = {} if options.phases is None else {"phases": options.phases}
    merged = overlay(raw, {"new_subjects": chosen})
    files = merged_files(options.config, options.overlay)
    return load_study(merged, in_words(options.config, options.overlay), options.cohort, files)


def experiments_to_ask(study: Study, asked: str | None) -> tuple[str, ...]:
    """Return the experiments that may answer, the first first: the one asked for, or all that run.

    Raises:
        ConfigError: The one asked for cannot answer, or none can.
    """
    able = {*study.config.speed_experiments, *study.config.population_experiments}
    if asked is not None:
        named(study, {"experiment": asked}, "experiment")
        if asked not in able:
            raise ConfigError(
                f"--experiment = {asked!r}: infers from features of the curve, and answers no recording "
                f"outside its own cohort; {' and '.join(name for name in _names(study) if name in able)} can"
            )
        return (asked,)
    if not study.answering_experiments:
        raise ConfigError(
            "run: no experiment of kind speeds or over a population runs, and no other answers a new subject"
        )
    return study.answering_experiments


def _names(study: Study) -> Sequence[str]:
    return (*study.config.experiments, *study.config.population_experiments)


def is_everyones(error: Exception) -> bool:
    """Tell whether an error is of the study, its network or the disk, and so of every subject of a folder."""
    return isinstance(error, ArtefactError | OSError | OtherNetworkError)


def check_new_subject(study: Study, experiment: str, subject: str) -> None:
    """Refuse a subject that the cohort does not have or whose files are wrong, or that was trained on.

    Raises:
        ConfigError: Says which.
    """
    if subject in study.new_refused:
        raise ConfigError(study.new_refused[subject])
    if subject not in study.new_rows:
        known = ", ".join((*study.new_rows, *study.new_refused))
        raise ConfigError(f"subject = {subject!r}: {study.new_cohort} has {known}")
    if where := trained_on(study, experiment, subject):
        raise ConfigError(where)


def choose_experiment(study: Study, subject: str, experiments: Sequence[str]) -> tuple[str, str]:
    """Return the first experiment that can answer for a subject's heart, and what to say of those before it.

    Raises:
        ValueError: None can; lists why, and which other experiment could.
    """
    reasons: dict[str, str] = {}
    for experiment in experiments:
        check_new_subject(study, experiment, subject)
        if not (reason := context_refusal(study, experiment, subject)):
            return experiment, _instead(reasons, experiment)
        reasons[experiment] = reason
    others = [name for name in study.answering_experiments if name not in reasons]
    able = [name for name in others if not context_refusal(study, name, subject)]
    hint = f"\n`--experiment {able[0]}` can answer for this heart." if able else ""
    raise ValueError("\n".join(f"{name}: {reason}" for name, reason in reasons.items()) + hint)


def _instead(reasons: Mapping[str, str], experiment: str) -> str:
    if not reasons:
        return ""
    told = "; ".join(
        f"{name} does not know such a heart ({why_in_short(text)})" for name, text in reasons.items()
    )
    return f"{told}: {experiment}, trained over a population, answers instead"


def folder_of(study: Study, experiment: str, subject: str) -> Path:
    """Return where the answer to a subject outside the study lies."""
    return Path(study.config.results) / experiment / "new" / study.new_cohort_name / subject


def check_untouched(folder: Path, recording: Recording) -> None:
    """Refuse to write over what is no answer, or the answer to another recording or heart.

    Raises:
        OtherAnswerError: Says what is there.
        ArtefactError: What is there is damaged.
    """
    if not folder.exists() or (folder.is_dir() and not any(folder.iterdir())):
        return
    kept = folder / OBSERVATION
    remedy = "name another folder by --out, or write over it by --force"
    if not kept.is_file():
        raise OtherAnswerError(f"{folder}: is there already and holds no answer; {remedy}")
    if not recording.is_kept_in(kept):
        raise OtherAnswerError(
            f"{folder}: holds the answer to another recording of {recording.observation.subject!r}, or its "
            f"row of subjects.csv has changed since; {remedy}"
        )


def trained_for_pushes(study: Study, subject: str, experiments: Sequence[str]) -> tuple[str, str]:
    """Return the first experiment whose trained network takes a free-running recording, or none and why."""

    def untrained(name: str) -> str:
        trained = finished_population(Path(study.config.results), name).estimator.is_file()
        return "" if trained else f"the network of {name} has not been trained"

    return network_of_pushes(study, subject, experiments, untrained)


@dataclass(frozen=True)
class Asked:
    """A recording that is asked about, with all that answers it.

    Attributes:
        recording: The recording, under the model.
        knowledge: What answers it.
        settings: What the answer depends on.
        origin: Seed, subject and code.
        experiment: By which experiment.
        note: What to say of that choice; empty where it is the usual one.
    """

    recording: Recording
    knowledge: Knowledge
    settings: OneAnswerSettings
    origin: Origin
    experiment: str
    note: str = ""

    def answer_into(self, folder: Path, *, force: bool = False) -> Answer:
        """Answer the recording, and put all files into ``folder``, or none.

        Raises:
            OtherAnswerError: The folder holds something else, and ``force`` is not given.
            ValueError: The recording cannot be answered.
            ArtefactError: The folder cannot be written.
        """
        if not force:
            check_untouched(folder, self.recording)
        settings = self.settings
        answer = answered(self.recording, self.knowledge, settings, self.origin.seed, settings.clinical)
        with folder_made_whole(folder) as made:
            save_answer(answer, self.knowledge, settings, self.origin, made)
        return answer


@dataclass(frozen=True)
class Answerer:
    """Answers recordings outside the study; what the study leaves for them is read once.

    Attributes:
        study: With the recordings as its new cohort.
        experiments: Those that may answer, the first first.
        options: What Snakemake is given for the same configuration.
    """

    study: Study
    experiments: tuple[str, ...]
    options: str
    _known: dict[str, Knowledge] = field(default_factory=dict)

    def asked(self, subject: str) -> Asked:
        """Read one recording, and choose what answers it.

        Raises:
            ConfigError: The cohort does not have the subject, or a network was trained on it.
            RecordingError: The recording cannot be used.
            ValueError: No network can answer for its heart.
            FileNotFoundError: The study has not been run.
        """
        study = self.study
        for experiment in self.experiments:
            check_new_subject(study, experiment, subject)
        # what is wrong with the file comes before what is missing of a study
        observed = observe(study, subject)
        if isinstance(observed, FreeObservation):
            return self._of_pushes(observed)
        experiment, note = choose_experiment(study, subject, self.experiments)
        settings = self._settings(experiment, subject)
        knowledge, noise = self._knowledge(experiment, settings), finished_experiment(study, experiment).noise
        check_quality(noise, settings.ingest.recording)
        recording = observed.under(settings, read_noise(noise).components)
        return self._asked(recording, knowledge, settings, experiment, note)

    def _of_pushes(self, observed: FreeObservation) -> Asked:
        """Choose the first network that takes a free-running recording, or else the prior."""
        subject = observed.subject
        network, why = trained_for_pushes(self.study, subject, self.experiments)
        experiment = network or self.experiments[0]
        settings = self._settings(experiment, subject)
        knowledge = self._knowledge(network, settings) if network else Knowledge()
        note = (BY_NETWORK if network else FROM_PRIOR).format(subject=subject, experiment=experiment, why=why)
        recording = FreeRecording(observed, free_model(observed, settings.exact_posterior.model))
        return self._asked(recording, knowledge, settings, experiment, note)

    def _asked(
        self,
        recording: Recording,
        knowledge: Knowledge,
        settings: OneAnswerSettings,
        experiment: str,
        note: str,
    ) -> Asked:
        origin = Origin(self.study.config.seed, recording.observation.subject, stage_code(CODE))
        return Asked(recording, knowledge, settings, origin, experiment, note)

    def _settings(self, experiment: str, subject: str) -> OneAnswerSettings:
        plain = stage_settings(self.study, ONE_ANSWER, experiment=experiment, subject=subject)
        return OneAnswerSettings.from_plain(plain)

    def _knowledge(self, experiment: str, settings: OneAnswerSettings) -> Knowledge:
        """Return what an experiment knows, trained under the settings that it has now.

        Raises:
            FileNotFoundError: It has not been run.
            OtherNetworkError: It was trained under other settings.
        """
        if experiment not in self._known:
            finished = finished_experiment(self.study, experiment)
            check_finished(finished, self.options)
            trained = stage_settings(self.study, finished.trained_by, experiment=experiment)
            check_network(finished.estimator, trained)
            self._known[experiment] = finished.knowledge(settings.verdict.rule)
        return self._known[experiment]
