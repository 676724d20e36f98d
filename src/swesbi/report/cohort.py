"""The cohort: who was recorded, and what quality control kept of each recording."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from swesbi.recording.observation import Observation
from swesbi.report.names import rejection
from swesbi.report.numbers import count, fixed, percent
from swesbi.report.table import Column, Row, Table, body

CONTEXT_COLUMNS: Final = (
    Column("Subject", numeric=False),
    Column("Sex", numeric=False),
    Column("Age", "years"),
    Column("Body surface area", "m²"),
    Column("Heart rate", "1/min"),
    Column("LVEDV", "mL"),
    Column("LVESV", "mL"),
    Column("Ejection fraction", "%"),
    Column("Septal thickness", "cm"),
)


def context_table(observations: Sequence[Observation], cohort_title: str) -> Table:
    """Return the context c_d of each subject; the ejection fraction is that of the measured volumes."""
    rows = []
    for context in (observation.context for observation in observations):
        ejected = 1.0 - context.lvesv_ml / context.lvedv_ml
        rows.append(
            (
                context.subject,
                context.sex,
                fixed(context.age_years, 0),
                fixed(context.bsa_m2, 2),
                fixed(context.hr_bpm, 0),
                fixed(context.lvedv_ml, 0),
                fixed(context.lvesv_ml, 0),
                percent(ejected, 0),
                fixed(context.ivsd_cm, 2),
            )
        )
    note = (
        "LVEDV, LVESV: left ventricular end-diastolic and end-systolic volume; septal thickness at "
        "end diastole. Heart rate, LVEDV and septal thickness set the simulator; "
        "all seven condition the posterior."
    )
    return Table(f"Context of each subject ({cohort_title}).", CONTEXT_COLUMNS, body(rows), note)


def recording_table(observations: Sequence[Observation], cohort_title: str) -> Table:
    """Return what quality control accepted and rejected of each recording, and why."""
    reasons = [
        reason
        for reason in observations[0].rejected
        if any(observation.rejected[reason] for observation in observations)
    ]
    columns = (
        Column("Subject", numeric=False),
        Column("Phases measured", "of recorded"),
        Column("Samples accepted", "of recorded"),
        *(Column(rejection(reason), "rejected") for reason in reasons),
        Column("Between repeats", "sd, % of speed"),
        Column("Within repeats", "sd, % of speed"),
        Column("Stiffness", "kPa, lowest to highest"),
    )
    rows = tuple(Row(_recording(observation, reasons)) for observation in observations)
    note = (
        "Each rejected sample counts once, for the first reason that applies. Stiffness is the range of the "
        "measured phases."
    )
    return Table(f"Recordings and quality control ({cohort_title}).", columns, rows, note)


def _recording(observation: Observation, reasons: Sequence[str]) -> tuple[str, ...]:
    accepted = int(observation.samples_accepted.sum())
    recorded = accepted + sum(observation.rejected.values())
    stiffness = observation.stiffness_kpa[observation.measured]
    return (
        observation.subject,
        f"{int(observation.measured.sum())} of {len(observation.phase)}",
        f"{count(accepted)} of {count(recorded)}",
        *(count(observation.rejected[reason]) for reason in reasons),
        percent(observation.noise.repeat_fraction),
        percent(observation.noise.sample_fraction),
        f"{fixed(float(stiffness.min()), 1)} to {fixed(float(stiffness.max()), 1)}",
    )
