"""An answer as a folder of files: artefacts, the verdict, two figures, the page."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import Final

from swesbi.answers.answer import Answer, predictive_output
from swesbi.answers.knowledge import Knowledge
from swesbi.answers.recording import ModelledRecording
from swesbi.answers.settings import OneAnswerSettings
from swesbi.answers.sheet import sheet_of
from swesbi.artefacts import ArtefactError, Origin, write_json
from swesbi.report.figures.posterior_subject import draw_exact_subject
from swesbi.report.figures.predictive import NETWORK_ALONE, ExactPanel
from swesbi.report.figures.sheet import draw_sheet
from swesbi.report.figures.style import save_figure
from swesbi.report.sheet import Sheet
from swesbi.verdict.verdict import Verdict

OBSERVATION: Final = "observation.h5"
POSTERIOR_FILE: Final = "posterior.h5"
VERDICT: Final = "verdict.json"
OUTPUTS: Final = (
    OBSERVATION, POSTERIOR_FILE, VERDICT, "predictive.h5", "ppc.png", "posterior.png", "sheet.pdf"
)  # fmt: skip
"""What is written of every answer."""
WITH_PRESSURES: Final = "with_pressures.h5"
"""A further output, of a subject of whom the pressures of a cuff were taken."""
PRIOR_DRAWS: Final = "prior, from which it began"
MADE_FROM: Final = "made_from"
"""Key of ``verdict.json``: the digest of all that the answer depends on."""
NOTES: Final = "notes"
"""Key of ``verdict.json``: what of the recording is left out, or odd, a sentence each."""


def made_from(
    recording: ModelledRecording,
    knowledge: Knowledge,
    settings: OneAnswerSettings,
    origin: Origin,
    notes: Sequence[str],
) -> str:
    """Return the digest of all that an answer depends on: the same digest, the same files."""
    said = {
        "notes": list(notes),
        "settings": settings.to_plain(),
        "origin": asdict(origin),
        "knowledge": knowledge.made_from,
        "noise": recording.noise,
        "tests": [asdict(test) for test in recording.tests],
    }
    digest = sha256(json.dumps(said, sort_keys=True).encode())
    errors = recording.model.recording
    groups = recording.observation.to_groups().values()
    observed = [values for group in groups for values in group.values()]
    for array in (*(values.to_numpy() for values in observed), errors.relative_se, errors.shared):
        digest.update(repr(array.tolist()).encode())
    return digest.hexdigest()


def kept_verdict(folder: Path, digest: str, *, pressures: bool) -> Verdict | None:
    """Return the verdict of an answer that lies in a folder, whole and made from just this; else None.

    Args:
        folder: Of the answer.
        digest: Of :func:`made_from`.
        pressures: Whether an answer with pressures belongs to it.
    """
    path = folder / VERDICT
    if not all((folder / name).is_file() for name in (*OUTPUTS, *([WITH_PRESSURES] if pressures else []))):
        return None
    try:
        verdict, content = Verdict.read(path), json.loads(path.read_text(encoding="utf-8"))
    except ArtefactError:
        return None
    return verdict if content.get(MADE_FROM) == digest else None


def save_answer(
    answer: Answer,
    knowledge: Knowledge,
    settings: OneAnswerSettings,
    origin: Origin,
    folder: Path,
    notes: Sequence[str] = (),
) -> Sheet:
    """Write an answer into a folder that is there, and return what its page shows.

    Args:
        answer: The answer.
        knowledge: What gave it.
        settings: Stored with the artefacts.
        origin: Seed, subject and code.
        folder: Output.
        notes: What of the recording is left out, or odd.

    Raises:
        ArtefactError: A file cannot be written.
        ValueError: No draw of the posterior can be simulated.
    """
    recording, exact, title = answer.recording, answer.posterior, settings.cohort_title
    made = origin.provenance("", settings)
    recording.observation.write(folder / OBSERVATION, made)
    exact.write(folder / POSTERIOR_FILE, made)
    digest = made_from(recording, knowledge, settings, origin, notes)
    write_json(folder / VERDICT, answer.verdict.to_json() | {MADE_FROM: digest, NOTES: list(notes)})
    if answer.with_pressures is not None:
        answer.with_pressures.write(folder / WITH_PRESSURES, made)
    shown = predictive_output(answer, settings, origin.seed)
    shown.check.write(folder / "predictive.h5", made)
    save_figure(shown.draw(title), folder / "ppc.png")
    began = PRIOR_DRAWS if knowledge.flow is None else NETWORK_ALONE
    panel = ExactPanel(origin.subject, exact, None, answer.verdict, None, began)
    save_figure(draw_exact_subject(panel, settings.joint_prior, title), folder / "posterior.png")
    page = sheet_of(answer, knowledge, shown, settings)
    save_figure(draw_sheet(page), folder / "sheet.pdf")
    return page
