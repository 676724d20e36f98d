"""Answering subjects outside the study: by which experiment, into which folder, what stays untouched."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Final

from swesbi.answers.answer import Knowledge, OneAnswerSettings, knowledge_from
from swesbi.answers.files import RecordingRequest
from swesbi.answers.recording import Folder, modelled_pushes, observe_folder
from swesbi.artefacts import ArtefactError, Provenance
from swesbi.config.read import ConfigError
from swesbi.config.study import Study, context_refusal, why_in_short
from swesbi.config.view import View, nulls_of
from swesbi.networks.flow.trained import SHIPPED_NETWORK
from swesbi.study.results import OtherNetworkError, check_network, experiment_files
from swesbi.study.stage import plain_settings, stage_code
from swesbi.verdict.settings import SHIPPED_NULLS

CODE: Final = "swesbi.answers.answer:answered"
"""What makes an answer: the code whose hash its artefacts keep."""
REFUSALS: Final = (ValueError, ArithmeticError, RuntimeError)
"""Errors of one subject, person or group, which leave the others as they are; but for these:"""
OF_ALL: Final = (ArtefactError, OSError, OtherNetworkError)
"""Errors of the study, its network or the disk, and so of every subject of a folder."""


def experiments_to_ask(study: Study, asked: str | None) -> tuple[str, ...]:
    """Return the experiments that may answer, the first first: the one asked for, or all that run."""
    able = (*study.config.speed_experiments, *study.config.population_experiments)
    if asked is not None:
        View(study, {"experiment": asked}).named("experiment")
        if asked not in able:
            raise ConfigError(
                f"--experiment = {asked!r}: infers from features of the curve, and answers no recording "
                f"outside its own cohort; {' and '.join(able)} can"
            )
        return (asked,)
    if not study.answering_experiments:
        raise ConfigError(
            "run: no experiment of kind speeds or over a population runs, and no other answers a new subject"
        )
    return study.answering_experiments


def answer_settings(study: Study, experiment: str, subject: str) -> OneAnswerSettings:
    """Return what the answer to a recording outside the study depends on."""
    view = View(study.of_outside, {"experiment": experiment, "subject": subject})
    said = study.description(subject)
    own = {"recording": said.settings.to_plain(), "layout": said.file.layout.to_plain()}
    others = [name for name in OneAnswerSettings.model_fields if name not in own]
    return OneAnswerSettings.from_plain(view.together(*others) | own)


@dataclass(frozen=True)
class Answerer:
    """Answers recordings outside the study; what the study leaves for them is read once.

    Of ``experiments``, those that may answer, the first is asked first; where that is ``required``, its
    network must answer gated recordings. ``options`` are what Snakemake is given for the same configuration.
    If ``from_prior``, no network is asked, though there is one. ``in_memory`` has recordings of no folder.
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

        A ValueError says that it cannot be used, or that the network that must answer does not know its
        heart.
        """
        if subject not in self.subjects:
            known = ", ".join(self.subjects)
            raise ConfigError(f"subject = {subject!r}: {self.study.outside.folder} has {known}")
        # what is wrong with the file comes before what is missing of a study
        if subject in self.folder.refused:
            raise ValueError(self.folder.refused[subject])
        observed = self.folder.observed[subject]
        network, why = self._network(subject, free=not observed.observation.is_gated)
        experiment = network or self.experiments[0]
        settings = answer_settings(self.study, experiment, subject)
        knowledge = self._knowledge(network) if network else self._prior
        if observed.observation.is_gated:
            recording = self.folder.gated(observed, settings.model, settings.noise_level)
        else:
            recording = modelled_pushes(observed.observation, settings.model)
        made = Provenance("", subject, self.study.config.seed, settings.to_plain(), stage_code(CODE))
        note = self._note(subject, network, why)
        return RecordingRequest(recording, knowledge, settings, made, experiment, note, observed.left_out)

    def _note(self, subject: str, network: str, why: str) -> str:
        """Return what to say of the choice of a network, or of none; empty where it is the usual one."""
        lines = []
        if why and not network:
            lines.append(f"{subject} is answered from the prior of {self.experiments[0]}: {why}")
        elif why and experiment_files(self.study, network).network == SHIPPED_NETWORK:
            lines.append(f"{subject} is answered by the network that comes with the package")
        elif why:
            lines.append(f"{subject} is answered by the network of {network}: {why}")
        if not (network or self._own_nulls):
            lines.append(
                f"{subject} is judged among null recordings of the package, of another prior or forward model"
            )
        return "\n".join(lines)

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
        """Return why a network, which must be there if it must answer, cannot; empty where it can."""
        if free and experiment not in self.study.config.population_experiments:
            return "takes no pushes"
        finished = experiment_files(self.study, experiment)
        if not finished.is_there:
            if self.required and not free:
                finished.check(self.options)
            return "has not been trained"
        return context_refusal(self.study, experiment, subject)

    @cached_property
    def _own_nulls(self) -> Path | None:
        """The null recordings of the model by which the prior answers; None where they are not made."""
        null = nulls_of(self.study, self.experiments[0])
        return null if null.is_file() else None

    @cached_property
    def _prior(self) -> Knowledge:
        return knowledge_from(self._own_nulls or SHIPPED_NULLS)

    def _knowledge(self, experiment: str) -> Knowledge:
        """Return what an experiment knows, trained under the settings that it has now."""
        if experiment not in self._known:
            finished = experiment_files(self.study, experiment)
            trained = plain_settings(finished.trained_by, View(self.study, {"experiment": experiment}))
            check_network(finished.network, trained)
            finished.check(self.options)
            self._known[experiment] = finished.knowledge()
        return self._known[experiment]
