"""A recording that is asked about, and its answer as a folder: artefacts, verdict, two figures, the page."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property, partial
from hashlib import sha256
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.figure import Figure

from swesbi.answers.answer import Answer, AnyCheck, Knowledge, OneAnswerSettings, answered, check_answer
from swesbi.answers.recording import ModelledRecording
from swesbi.artefacts import ArtefactError, DamagedArtefactError, Provenance, folder_made_whole, write_json
from swesbi.artefacts.files import provenance_of
from swesbi.base.arrays import FloatArray
from swesbi.base.workers import in_processes
from swesbi.checks.information import MoreRepeats, more_repeats
from swesbi.checks.predictive import FreePredictiveCheck
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.observation import SOURCES, Observation, same_recording
from swesbi.report.figures.posterior import NETWORK_ALONE, PosteriorPanel, draw_corner
from swesbi.report.figures.predictive import PredictivePanel, draw_free_check, draw_subject_check
from swesbi.report.figures.sheet import draw_sheet
from swesbi.report.figures.style import save_figure
from swesbi.report.sheet import (
    Population,
    PressuresPosterior,
    Sheet,
    curve_free,
    curve_gated,
    recorded_free,
    recorded_gated,
)
from swesbi.verdict.verdict import Verdict

OBSERVATION: Final = "observation.h5"
POSTERIOR_FILE: Final = "posterior.h5"
VERDICT: Final = "verdict.json"
NUMBERS: Final = (OBSERVATION, POSTERIOR_FILE, VERDICT, "predictive.h5")
"""What is written of every answer."""
FIGURES: Final = {"none": (), "sheet": ("sheet.pdf",), "all": ("sheet.pdf", "posterior.png", "ppc.png")}
"""What is drawn of it, as asked for; what takes longest is first."""
OUTPUTS: Final = (*NUMBERS, *FIGURES["all"])
WITH_PRESSURES: Final = "with_pressures.h5"
"""A further output, of a subject of whom the pressures of a cuff were taken."""
MADE_FROM: Final = "made_from"
"""Key of ``verdict.json``: the digest of all that the answer depends on."""


class OtherAnswerError(ValueError):
    """A folder holds the answer to another recording, or something else; it is left as it is."""


@dataclass(frozen=True)
class RecordingRequest:
    """A recording that is asked about, with all that answers it.

    ``note`` says why this experiment, where it is not the usual one; ``left_out`` what of the recording is
    left out, or odd, a sentence each.
    """

    recording: ModelledRecording
    knowledge: Knowledge
    settings: OneAnswerSettings
    made: Provenance
    experiment: str
    note: str = ""
    left_out: tuple[str, ...] = ()

    @cached_property
    def digest(self) -> str:
        """The digest of all that the answer depends on: the same digest, the same files."""
        said = {
            "notes": list(self.left_out),
            "settings": self.settings.to_plain(),
            "origin": {name: getattr(self.made, name) for name in ("seed", "subject", "code_hash")},
            "knowledge": self.knowledge.made_from,
            "noise": self.recording.noise,
            "tests": [asdict(test) for test in self.recording.tests],
        }
        digest = sha256(json.dumps(said, sort_keys=True).encode())
        errors = self.recording.model.recording
        groups = self.recording.observation.to_groups().values()
        observed = [values for group in groups for values in group.values()]
        for array in (*(values.to_numpy() for values in observed), errors.relative_se, errors.shared):
            digest.update(repr(array.tolist()).encode())
        return digest.hexdigest()

    def kept_in(self, folder: Path, figures: str = "all") -> Verdict | None:
        """Return the verdict of this very answer, where it lies in ``folder`` already, whole; else None."""
        outputs = (*NUMBERS, *FIGURES[figures], *([WITH_PRESSURES] if self.recording.has_pressures else []))
        if not all((folder / name).is_file() for name in outputs):
            return None
        path = folder / VERDICT
        try:
            for stored in (folder / name for name in outputs if name.endswith(".h5")):
                provenance_of(stored)  # damaged files are made again
            verdict, content = Verdict.read(path), json.loads(path.read_text(encoding="utf-8"))
        except ArtefactError:
            return None
        return verdict if content.get(MADE_FROM) == self.digest else None

    def answer_into(self, folder: Path, *, force: bool = False, figures: str = "all") -> tuple[Answer, Sheet]:
        """Answer the recording, put all files into ``folder``, or none, and return what its page shows.

        ``figures`` is a key of ``FIGURES``. A folder that holds something else is refused without ``force``.
        """
        if not force:
            check_untouched(folder, self.recording)
        settings = self.settings
        answer = answered(self.recording, self.knowledge, settings, self.made.seed, settings.clinical)
        with folder_made_whole(folder, VERDICT) as made:
            page = self._write(answer, made, FIGURES[figures])
            for name in {*OUTPUTS, WITH_PRESSURES} - {path.name for path in made.iterdir()}:
                (folder / name).unlink(missing_ok=True)  # of a former answer
        return answer, page

    def _write(self, answer: Answer, folder: Path, figures: Sequence[str]) -> Sheet:
        """Write the answer into a folder that is there, and return what its page shows."""
        settings, exact, title = self.settings, answer.posterior, self.settings.cohort_title
        self.recording.observation.write(folder / OBSERVATION, self.made)
        exact.write(folder / POSTERIOR_FILE, self.made)
        further = {MADE_FROM: self.digest, "notes": list(self.left_out)}
        write_json(folder / VERDICT, answer.verdict.to_json() | further)
        if answer.with_pressures is not None:
            answer.with_pressures.write(folder / WITH_PRESSURES, self.made)
        check = check_answer(answer, settings, self.made.seed)
        check.write(folder / "predictive.h5", self.made)
        began = "prior, from which it began" if self.knowledge.flow is None else NETWORK_ALONE
        panel = PosteriorPanel.of(self.made.subject, exact, answer.verdict, start=began)
        page = sheet_of(answer, self.knowledge, check, settings)
        drawn = {
            "ppc.png": partial(draw_check, answer, check, title),
            "posterior.png": partial(draw_corner, panel, settings.joint_prior, title),
            "sheet.pdf": partial(draw_sheet, page),
        }
        in_processes(lambda name: save_figure(drawn[name](), folder / name), figures)
        return page


def draw_check(answer: Answer, check: AnyCheck, title: str) -> Figure:
    """Draw the predictive check of an answer."""
    observed, verdict = answer.recording.observation, answer.verdict
    if isinstance(check, FreePredictiveCheck):
        return draw_free_check(observed.subject, check, verdict, SOURCES[observed.errors_from], title)
    return draw_subject_check(PredictivePanel(observed.subject, check, None, verdict), title)


def check_untouched(folder: Path, recording: ModelledRecording) -> None:
    """Refuse to write over what is no answer, or the answer to another recording or heart."""
    if not folder.exists() or (folder.is_dir() and not any(folder.iterdir())):
        return
    kept, asked = folder / OBSERVATION, recording.observation
    remedy = "name another folder by --out, or write over it by --force"
    if not kept.is_file():
        raise OtherAnswerError(f"{folder}: is there already and holds no answer; {remedy}")
    try:
        is_observation = provenance_of(kept).kind == Observation.kind
        same = is_observation and same_recording(Observation.read(kept), asked)
    except DamagedArtefactError as error:
        raise OtherAnswerError(f"{kept}: {error.fault}; {remedy}") from error
    if not same:
        raise OtherAnswerError(
            f"{folder}: holds the answer to another recording of {asked.subject!r}, or its row of "
            f"subjects.csv has changed since; {remedy}"
        )


def sheet_of(answer: Answer, knowledge: Knowledge, check: AnyCheck, settings: OneAnswerSettings) -> Sheet:
    """Return what the page of an answer, with its predictive check, shows."""
    recording, exact = answer.recording, answer.posterior
    observed, both = recording.observation, answer.with_pressures
    if isinstance(check, FreePredictiveCheck):
        recorded, curve = recorded_free(observed), curve_free(check)
    else:
        recorded, curve = recorded_gated(observed), curve_gated(check)
    return Sheet(
        context=observed.context,
        verdict=answer.verdict,
        result=exact,
        values=_rows(answer.reported),
        recorded=replace(recorded, noise=recording.noise),
        curve=curve,
        population=Population(knowledge.population, _rows(answer.prior.reported), knowledge.hearts),
        more=_more(recording, exact, settings),
        informed=[] if both is None else [PressuresPosterior(observed.clinical, both)],
        cohort_title=settings.cohort_title,
    )


def _rows(reported: Mapping[str, FloatArray]) -> FloatArray:
    """Return all that the answer tells of those of n draws that have a beat; shape (m, q)."""
    values = np.column_stack(list(reported.values()))
    return np.asarray(values[np.isfinite(values).all(axis=1)])


def _more(
    recording: ModelledRecording, exact: ExactPosterior, settings: OneAnswerSettings
) -> MoreRepeats | None:
    """Return what more repeats would buy, by draws spread over those of the posterior.

    None of a posterior that has not converged, whose widths mean nothing.
    """
    if not exact.converged:
        return None
    number = min(settings.repeats_draws, len(exact.phi))
    rows = np.linspace(0, len(exact.phi) - 1, number).astype(np.int64)
    return more_repeats(recording.model, exact.phi[rows], settings.difference_step)
