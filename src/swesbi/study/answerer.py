"""Answering subjects outside the study: by which experiment, into which folder, what stays untouched."""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Final

from swesbi.answers.answer import Answer, answered
from swesbi.answers.files import OBSERVATION, VERDICT, kept_verdict, made_from, save_answer
from swesbi.answers.folder import Folder, observe_folder
from swesbi.answers.knowledge import Knowledge, knowledge_of_prior
from swesbi.answers.recording import ModelledRecording, modelled_pushes
from swesbi.answers.settings import OneAnswerSettings
from swesbi.artefacts import ArtefactError, Origin, folder_made_whole
from swesbi.config.read import ConfigError, in_words, merged_files, overlay, read_merged
from swesbi.config.refusals import context_refusal, why_in_short
from swesbi.config.study import Study, load_study
from swesbi.config.view import View
from swesbi.networks.flow.trained import SHIPPED_NETWORK
from swesbi.report.sheet import Sheet
from swesbi.study.nulls import nulls_of
from swesbi.study.other_network import OtherNetworkError, check_network
from swesbi.study.results import experiment_files
from swesbi.study.stage import plain_settings, stage_code
from swesbi.verdict.settings import SHIPPED_NULLS
from swesbi.verdict.verdict import Verdict

EXIT_REFUSED: Final = 2
"""Of a command that goes on where a subject, or a person, of a folder is refused."""
CODE: Final = "swesbi.answers.answer:answered"
"""What makes an answer: the code whose hash its artefacts keep."""
FROM_PRIOR: Final = "{subject} is answered from the prior of {name}: {why}"
OTHER_NULLS: Final = (
    "{subject} is judged among null recordings of the package, of another prior or forward model"
)
BY_PACKAGE: Final = "{subject} is answered by the network that comes with the package"
INSTEAD: Final = "{subject} is answered by the network of {name}: {why}"


class OtherAnswerError(ValueError):
    """A folder holds the answer to another recording, or something else; it is left as it is."""


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
        View(study, {"experiment": asked}).named("experiment")
        if asked not in able:
            names = (*study.config.experiments, *study.config.population_experiments)
            raise ConfigError(
                f"--experiment = {asked!r}: infers from features of the curve, and answers no recording "
                f"outside its own cohort; {' and '.join(name for name in names if name in able)} can"
            )
        return (asked,)
    if not study.answering_experiments:
        raise ConfigError(
            "run: no experiment of kind speeds or over a population runs, and no other answers a new subject"
        )
    return study.answering_experiments


def answer_settings(study: Study, experiment: str, subject: str) -> OneAnswerSettings:
    """Return what the answer to a recording outside the study depends on.

    Raises:
        ConfigError: The experiment has no such settings.
    """
    view, said = (
        View(study.of_outside, {"experiment": experiment, "subject": subject}),
        study.description(study.outside, subject),
    )
    own = {"recording": said.settings.to_plain(), "layout": said.file.layout.to_plain()}
    others = [name for name in OneAnswerSettings.model_fields if name not in own]
    return OneAnswerSettings.from_plain(view.together(*others) | own)


def is_everyones(error: Exception) -> bool:
    """Tell whether an error is of the study, its network or the disk, and so of every subject of a folder."""
    return isinstance(error, ArtefactError | OSError | OtherNetworkError)


def check_new_subject(study: Study, subject: str) -> None:
    """Refuse a subject that the folder does not have, or whose files are wrong.

    Raises:
        ConfigError: Says which.
    """
    if subject in study.outside.refused:
        raise ConfigError(study.outside.refused[subject])
    if subject not in study.outside.rows:
        known = ", ".join((*study.outside.rows, *study.outside.refused))
        raise ConfigError(f"subject = {subject!r}: {study.outside.folder} has {known}")


def check_untouched(folder: Path, recording: ModelledRecording) -> None:
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


@dataclass(frozen=True)
class RecordingRequest:
    """A recording that is asked about, with all that answers it.

    Attributes:
        recording: The recording, under the model.
        knowledge: What answers it.
        settings: What the answer depends on.
        origin: Seed, subject and code.
        experiment: By which experiment.
        note: What to say of that choice; empty where it is the usual one.
        left_out: What of the recording is left out, or odd, a sentence each.
    """

    recording: ModelledRecording
    knowledge: Knowledge
    settings: OneAnswerSettings
    origin: Origin
    experiment: str
    note: str = ""
    left_out: tuple[str, ...] = ()

    def kept_in(self, folder: Path) -> Verdict | None:
        """Return the verdict of this very answer, where it lies in ``folder`` already, whole; else None."""
        digest = made_from(self.recording, self.knowledge, self.settings, self.origin, self.left_out)
        observed = self.recording.observation
        pressures = observed.clinical.has_pressures and observed.is_gated
        return kept_verdict(folder, digest, pressures=pressures)

    def answer_into(self, folder: Path, *, force: bool = False) -> tuple[Answer, Sheet]:
        """Answer the recording, put all files into ``folder``, or none, and return what its page shows.

        Raises:
            OtherAnswerError: The folder holds something else, and ``force`` is not given.
            ValueError: The recording cannot be answered.
            ArtefactError: The folder cannot be written.
        """
        if not force:
            check_untouched(folder, self.recording)
        settings = self.settings
        answer = answered(self.recording, self.knowledge, settings, self.origin.seed, settings.clinical)
        with folder_made_whole(folder, VERDICT) as made:
            page = save_answer(answer, self.knowledge, settings, self.origin, made, self.left_out)
        return answer, page


@dataclass(frozen=True)
class Answerer:
    """Answers recordings outside the study; what the study leaves for them is read once.

    Attributes:
        study: With the recordings as its new cohort.
        experiments: Those that may answer, the first first.
        options: What Snakemake is given for the same configuration.
        from_prior: Whether no network is asked, though there is one.
        required: Whether gated recordings must be answered by the network of the first.
        in_memory: The recordings, where they are in no folder.
    """

    study: Study
    experiments: tuple[str, ...]
    options: str
    from_prior: bool = False
    required: bool = False
    in_memory: Folder | None = None
    _known: dict[str, Knowledge] = field(default_factory=dict)

    @property
    def subjects(self) -> tuple[str, ...]:
        """All subjects of the folder, those whose row cannot be used last."""
        return (*self.study.outside.rows, *self.study.outside.refused)

    @cached_property
    def folder(self) -> Folder:
        """The recordings, read once."""
        return self.in_memory or observe_folder(self.study)

    def request(self, subject: str) -> RecordingRequest:
        """Choose what answers a recording.

        Raises:
            ConfigError: The folder does not have the subject.
            ValueError: The recording cannot be used, or the network that must answer does not know its heart.
            FileNotFoundError: The experiment that must answer has not been run.
            OtherNetworkError: A network was trained under other settings.
        """
        check_new_subject(self.study, subject)
        # what is wrong with the file comes before what is missing of a study
        if subject in self.folder.refused:
            raise ValueError(self.folder.refused[subject])
        observed = self.folder.observed[subject]
        network, why = self._network(subject, free=not observed.observation.is_gated)
        experiment = network or self.experiments[0]
        settings = answer_settings(self.study, experiment, subject)
        knowledge = self._knowledge(network) if network else self._prior
        if observed.observation.is_gated:
            recording = self.folder.gated(observed, settings)
        else:
            recording = modelled_pushes(observed.observation, settings.model)
        origin = Origin(self.study.config.seed, subject, stage_code(CODE))
        said = BY_PACKAGE if network and self._by_package(network) else INSTEAD if network else FROM_PRIOR
        note = why and said.format(subject=subject, name=experiment, why=why)
        if network == "" and self._of_another_model:
            note = "\n".join(filter(None, (note, OTHER_NULLS.format(subject=subject))))
        return RecordingRequest(recording, knowledge, settings, origin, experiment, note, observed.left_out)

    def _network(self, subject: str, *, free: bool) -> tuple[str, str]:
        """Return the first experiment whose network can answer, or none, and why not those before it."""
        if self.from_prior:
            return "", "no network is asked"
        reasons: list[str] = []
        for name in self.experiments:
            reason = self._refusal(name, subject, free=free)
            if not reason:
                return name, "; ".join(reasons)
            if self.required and not free:
                raise ValueError(f"{name}: {reason}")
            reasons.append(f"the network of {name} {why_in_short(reason)}")
        return "", "; ".join(reasons)

    def _refusal(self, experiment: str, subject: str, *, free: bool) -> str:
        """Return why a network cannot answer for a recording; empty where it can.

        Raises:
            FileNotFoundError: It must answer, and has not been trained.
        """
        if free and experiment not in self.study.config.population_experiments:
            return "takes no pushes"
        finished = experiment_files(self.study, experiment)
        if not finished.is_there:
            if self.required and not free:
                finished.check(self.options)
            return "has not been trained"
        return context_refusal(self.study, experiment, subject)

    def _by_package(self, experiment: str) -> bool:
        return experiment_files(self.study, experiment).network == SHIPPED_NETWORK

    @cached_property
    def _prior(self) -> Knowledge:
        return knowledge_of_prior(SHIPPED_NULLS if self._of_another_model else self._nulls)

    @cached_property
    def _nulls(self) -> Path:
        """The null recordings of the model by which the prior answers."""
        return nulls_of(self.study, self.experiments[0])

    @property
    def _of_another_model(self) -> bool:
        """Whether the null recordings of that model have not been made."""
        return not self._nulls.is_file()

    def _knowledge(self, experiment: str) -> Knowledge:
        """Return what an experiment knows, trained under the settings that it has now.

        Raises:
            OtherNetworkError: It was trained under other settings.
        """
        if experiment not in self._known:
            finished = experiment_files(self.study, experiment)
            trained = plain_settings(finished.trained_by, View(self.study, {"experiment": experiment}))
            check_network(finished.network, trained)
            finished.check(self.options)
            self._known[experiment] = finished.knowledge()
        return self._known[experiment]
