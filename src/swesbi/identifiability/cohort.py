"""The identifiability of a whole cohort."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from swesbi.identifiability.designs import Placement, place_phases
from swesbi.identifiability.settings import IdentifiabilitySettings
from swesbi.identifiability.subject import RecordedSubject, SubjectIdentifiability, identify, stencil_of
from swesbi.progress import Progress


@dataclass(frozen=True)
class CohortIdentifiability:
    """Every subject's identifiability, and phases chosen for all; in the order of ``recorded``."""

    recorded: tuple[RecordedSubject, ...]
    subjects: tuple[SubjectIdentifiability, ...]
    placement: Placement


def identify_cohort(
    recorded: Sequence[RecordedSubject], settings: IdentifiabilitySettings, seed: int
) -> CohortIdentifiability:
    """Study every subject, and choose phases for the cohort.

    Raises:
        ValueError: There is no subject.
    """
    if not recorded:
        raise ValueError("no subject: the cohort is empty")
    progress = Progress("identifiability", len(recorded), "subject")
    subjects = []
    for one in recorded:
        subjects.append(identify(one, settings, seed))
        progress.step(note=one.name)
    draws = settings.design.placement_draws
    placement = place_phases(
        [one.model for one in recorded],
        [stencil_of(one, draws, settings, seed) for one in recorded],
        [one.duration_s for one in recorded],
        [one.repeat_variance / one.equivalent_repeats for one in recorded],
        settings.design,
    )
    return CohortIdentifiability(tuple(recorded), tuple(subjects), placement)
