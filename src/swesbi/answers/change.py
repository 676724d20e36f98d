"""Two visits of one person, each answered: what has changed between them."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from swesbi.answers.answer import Answer, Knowledge
from swesbi.artefacts import Provenance
from swesbi.artefacts.csv import write_csv
from swesbi.base.arrays import FloatArray
from swesbi.base.progress import LOGGER
from swesbi.base.settings import Settings
from swesbi.checks.scores import Band
from swesbi.draws import median_and_interval
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings
from swesbi.persons.change.joint import both_visits, infer_change, stored_change
from swesbi.persons.change.stored import StoredChange, change_table
from swesbi.persons.settings import ChangeSettings
from swesbi.recording.observation import Observation
from swesbi.recording.speed import youngs_modulus_kpa
from swesbi.report.figures.change import ShownVisit, draw_change
from swesbi.report.figures.style import save_figure
from swesbi.verdict.verdict import Verdict

SHOWN_DRAWS: Final = 500
SHOWN_PHASES: Final = 100


class PersonChangeSettings(Settings):
    """What the change of a person depends on beside the answers to both visits."""

    model: SpeedModelSettings
    changes: ChangeSettings
    person: str
    visits: tuple[str, str]
    cohort_title: str


JOINT: Final = "change.h5"
TABLE: Final = "change.csv"
OUTPUTS: Final = (JOINT, TABLE, "change.pdf", "change.png", "sheet.pdf")
"""What is written of the change of a person."""


def save_change(
    answers: Sequence[Answer],
    knowledge: Knowledge,
    settings: PersonChangeSettings,
    made: Provenance,
    folder: Path,
) -> StoredChange:
    """Infer two visits of one person, the earlier first, together, and write what has changed between them.

    The folder is there.
    """
    observed = [answer.recording.observation for answer in answers]
    check_protocols(observed, settings.visits)
    models = [answer.recording.model for answer in answers]
    own, spaces = [answer.posterior for answer in answers], [knowledge.space(model) for model in models]
    both = both_visits(models, observed, settings.changes)
    names = (settings.person, *(each.subject for each in observed))
    found = infer_change(both, own, spaces, settings.changes, made.seed, *names)
    judged = [answer.verdict for answer in answers]
    (earlier, later), (first, second) = observed, judged
    subjects, statuses = (earlier.subject, later.subject), (first.status, second.status)
    whose = (settings.person, settings.visits, subjects, statuses)
    stored = stored_change(found, *whose, settings.changes, settings.model.prior.names)
    stored.write(folder / JOINT, made)
    write_csv(folder / TABLE, change_table(stored))
    shown = [
        _shown(*each, stored.interval_mass) for each in zip(models, observed, found.phi, judged, strict=True)
    ]
    title = settings.cohort_title
    save_figure(draw_change(stored, shown, title), folder / "change.pdf", folder / "change.png")
    save_figure(draw_change(stored, shown, title, page=True), folder / "sheet.pdf")
    _report(stored, found.efficiency)
    return stored


def check_protocols(observed: Sequence[Observation], visits: Sequence[str]) -> None:
    """Refuse visits that are free-running, or were gated at different numbers of phases."""
    for each in observed:
        if not each.is_gated:
            raise ValueError(
                f"{each.subject} is free-running: visits are compared phase by phase, so both must be gated"
            )
    phases = [len(each.phase) for each in observed]
    if len(set(phases)) > 1:
        had = ", ".join(f"{visit!r} {number}" for visit, number in zip(visits, phases, strict=True))
        raise ValueError(
            f"gated phases by visit: {had}; visits are compared phase by phase, so both need the same "
            "protocol"
        )


def _shown(
    model: SpeedModel, observed: Observation, phi: FloatArray, verdict: Verdict, mass: float
) -> ShownVisit:
    """Return a visit with the band of its curve under the joint posterior, at even phases."""
    phase = (np.arange(SHOWN_PHASES) + 0.5) / SHOWN_PHASES
    densely = replace(model, recording=replace(model.recording, phase=phase))
    speed = densely.predict(phi[:SHOWN_DRAWS]).speed_m_s
    known = speed[np.isfinite(speed).all(axis=1)]
    kpa = youngs_modulus_kpa(known, model.settings.density_kg_m3)
    low, median, high = median_and_interval(kpa, mass)
    return ShownVisit(observed, verdict, phase, Band(median=median, low=low, high=high))


def _report(stored: StoredChange, efficiency: Sequence[float]) -> None:
    rounds = ", ".join(f"{share:.1%}" for share in efficiency)
    LOGGER.info("efficiency of the first proposal for both visits and of each after it: %s", rounds)
    LOGGER.info(
        "%s, %s to %s: draws by %s; k-hat %.2f, efficiency %.1f %%",
        stored.person, *stored.visit, stored.sampler, stored.k_hat, 100.0 * stored.efficiency,
    )  # fmt: skip
    if stored.reasons:
        LOGGER.log(logging.INFO if stored.converged else logging.WARNING, "  %s", stored.reasons)
